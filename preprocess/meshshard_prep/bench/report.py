"""Figures of a benchmark as JSON, a page and a plot."""

from pathlib import Path
from typing import Any

from meshshard.files import publish
from meshshard.plain import to_json

PAGE = """# Speed of the preparation

Written by `make bench`: one run, ours and the peer's calls in turn, one thread for each process, medians of CPU time
(for two workers: elapsed). The peer is the published preparation in plain scipy and potpourri3d
(`preprocess/meshshard_prep/bench/peer.py`), its HKS from `eigsh` with all but three eigenpairs, or {few} beyond
{full} vertices. Meshes are generated: closed, smooth, near to a sphere, which is where factors fill most.

Processor: {processor}. {versions}.

## HKS alone, from the same Laplacian

| vertices | peer, ms | ours, ms | ratio | error of ours | its bound | error of the peer |
|---|---|---|---|---|---|---|
{hks}

Errors are the largest relative ones over all vertices and times, against the full spectrum by dense LAPACK.

## From a file to a Sample, one core

| vertices | peer, ms | ours, ms | ratio |
|---|---|---|---|
{path}

At 752 vertices: {parts}. With two workers {two:.3g} ms a mesh elapsed, {scaling:.2f} times as fast as with one.
{large}
![CPU time over vertices](hks.png)
"""


def write(folder: Path, figures: dict[str, Any]) -> None:
    """`hks.json`, `hks.md` and `hks.png` in `folder`."""
    folder.mkdir(parents=True, exist_ok=True)
    publish(folder / "hks.json", (to_json(figures) + "\n").encode())
    publish(folder / "hks.md", page(figures).encode())
    plot(folder / "hks.png", figures["hks"])


def page(figures: dict[str, Any]) -> str:
    """The figures as Markdown."""
    large = figures.get("large")
    return PAGE.format(
        few=figures["few_pairs"],
        full=figures["full_up_to"],
        processor=figures["processor"],
        versions=", ".join(f"{name} {version}" for name, version in figures["versions"].items()),
        hks="\n".join(
            f"| {row['vertices']} | {row['peer_ms']:.4g} | {row['ours_ms']:.4g} | {row['ratio']:.1f} | "
            f"{_error(row, 'ours_error')} | {row['bound']:.1e} | {_error(row, 'peer_error')} |"
            for row in figures["hks"]
        ),
        path="\n".join(
            f"| {row['vertices']} | {row['peer_ms']:.4g} | {row['ours_ms']:.4g} | {row['ratio']:.1f} |"
            for row in figures["path"]
        ),
        parts=", ".join(f"{name} {spent:.2f} ms" for name, spent in figures["parts"].items()),
        two=figures["workers"]["two_ms"],
        scaling=figures["workers"]["scaling"],
        large=""
        if large is None
        else f"\nA mesh of {large['faces']:,.0f} faces: all features in {large['seconds']:.0f} s on one core, "
        f"{large['gigabytes']:.1f} GB at most, error bound {large['bound']:.1e}.\n",
    )


def _error(row: dict[str, Any], name: str) -> str:
    return format(row[name], ".1e") if name in row else ""


def plot(path: Path, rows: list[dict[str, Any]]) -> None:
    """CPU time over vertices, both logarithmic."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6, 4), layout="constrained")
    axes = figure.subplots()
    for label, marker, some in (
        ("eigsh, all but three pairs", "s--", [row for row in rows if "peer_error" in row]),
        (f"eigsh, {rows[-1]['peer_pairs']} pairs", "D--", [row for row in rows if "peer_error" not in row]),
    ):
        if some:
            axes.loglog([row["vertices"] for row in some], [row["peer_ms"] for row in some], marker, label=label)
    axes.loglog(
        [row["vertices"] for row in rows],
        [row["ours_ms"] for row in rows],
        "o-",
        label="selected inversion, all pairs",
    )
    axes.set(xlabel="vertices", ylabel="CPU time, ms", title="Heat kernel signature at 16 times")
    axes.grid(visible=True, which="both", alpha=0.3)
    axes.legend()
    figure.savefig(path, dpi=120, metadata={"Software": None})
