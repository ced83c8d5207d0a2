"""The same training from several seeds: every run listed, and mean and deviation of every figure."""

from collections.abc import Sequence
from pathlib import Path
from statistics import fmean, stdev
from typing import Any

from meshshard.files import publish
from meshshard.plain import to_json

SEEDS = "seeds.json"


def folder_of(run: Path, seed: int) -> Path:
    """The run of one seed."""
    return run / f"seed-{seed}"


def write_seeds(run: Path, results: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Put the `results.json` of runs that differ by their seed alone together into seeds.json and seeds.md.

    `figures` holds, for each split and name, `mean`, `deviation` (of the sample: over n - 1; NaN for one run) and the
    `values` of the runs in their order.
    """
    first = results[0]
    summary = {name: first[name] for name in ("dataset", "task", "recipe", "feature_recipe", "protocol")}
    summary |= {
        "seeds": [result["seed"] for result in results],
        "figures": {split: _figures([result["rows"][split] for result in results]) for split in first["rows"]},
        "runs": list(results),
    }
    publish(run / SEEDS, to_json(summary).encode() + b"\n")
    publish(run / "seeds.md", _markdown(summary).encode())
    return summary


def _figures(rows: Sequence[dict[str, Any]]) -> dict[str, dict[str, Any]]:
    found = {}
    for name, value in rows[0].items():
        if isinstance(value, int | float):
            values = [row[name] for row in rows]
            deviation = stdev(values) if len(values) > 1 else float("nan")
            found[name] = {"mean": fmean(values), "deviation": deviation, "values": values}
    return found


def table_rows(summary: dict[str, Any]) -> list[list[str]]:
    """Head and rows of the table: of each split and figure the mean, the deviation, and every run."""
    head = ["split", "figure", "mean", "deviation", *(f"seed {seed}" for seed in summary["seeds"])]
    rows = [
        [split, name.replace("_", " "), *(f"{value:.4f}" for value in (of["mean"], of["deviation"], *of["values"]))]
        for split, figures in summary["figures"].items()
        for name, of in figures.items()
    ]
    return [head, *rows]


def _markdown(summary: dict[str, Any]) -> str:
    head, *rows = table_rows(summary)
    about = f"{summary['dataset']}, recipe {summary['recipe']}, {len(summary['seeds'])} seeds; {summary['protocol']}."
    return about + "\n\n" + "".join(f"| {' | '.join(line)} |\n" for line in [head, ["---"] * len(head), *rows])
