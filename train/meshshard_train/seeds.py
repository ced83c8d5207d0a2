"""The same training from several seeds: every run listed, and mean and deviation of every figure."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from meshshard.files import publish
from meshshard.plain import to_json
from meshshard_train.config import VOTED
from meshshard_train.tables import markdown_table, per_cent

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
        if isinstance(value, float):
            values = [row[name] for row in rows]
            deviation = float(np.std(values, ddof=1)) if len(values) > 1 else float("nan")
            found[name] = {"mean": float(np.mean(values)), "deviation": deviation, "values": values}
    return found


def about(summary: dict[str, Any]) -> str:
    """What the figures are of."""
    seeds = len(summary["seeds"])
    return (
        f"{summary['dataset']}, recipe {summary['recipe']}, {seeds} seed{'s' * (seeds != 1)}; {summary['protocol']}. "
        "Per cent; geodesic errors in hundredths of the square root of the area"
    )


def table_rows(summary: dict[str, Any]) -> list[list[str]]:
    """Head and rows of the table: epoch and rounds of voting of every run; of each split and figure the mean, the
    deviation, and every run."""
    runs = summary["runs"]
    head = ["split", "figure", "mean", "deviation", *(f"seed {seed}" for seed in summary["seeds"])]
    rows = [["", "epoch", "", "", *(str(run["epoch"]) for run in runs)]]
    if summary["task"] in VOTED:
        rows.append(["", "rounds of voting", "", "", *(str(run["voting_rounds"]) for run in runs)])
    rows += [
        [split, name.replace("_", " "), *map(per_cent, (of["mean"], of["deviation"], *of["values"]))]
        for split, figures in summary["figures"].items()
        for name, of in figures.items()
    ]
    return [head, *rows]


def _markdown(summary: dict[str, Any]) -> str:
    return f"{about(summary)}.\n\n{markdown_table(table_rows(summary))}\n"
