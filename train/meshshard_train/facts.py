"""What goes with the figures of a run: of which data, settings and checkpoint they are."""

import json
from collections.abc import Sequence
from typing import Any

from meshshard import Dataset
from meshshard_train.checkpoint import Checkpoint
from meshshard_train.members import training_numbers


def facts_of(best: Checkpoint, dataset: Dataset, splits: Sequence[str]) -> dict[str, Any]:
    """Keys of results.json that every task has. `trained_on`: of each split, how many meshes the run trained on."""
    learned = set(training_numbers(dataset, best.config))
    return {
        "dataset": dataset.name,
        "task": best.config.task,
        "recipe": best.config.recipe,
        "feature_recipe": best.recipe.name,
        "epoch": best.state["epoch"],
        "seed": best.config.seed,
        "config": json.loads(best.config.to_json()),
        "splits_sha256": dataset.index.splits_sha256,
        "content_sha256": dataset.index.content_sha256,
        "trained_on": {split: len(learned.intersection(dataset.splits.get(split, ()))) for split in splits},
    }


def of_history(history: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Keys of results.json that a finished run adds. `computed_in`: precisions of its epochs; `compiled`: by any."""
    return {
        "epochs": len(history),
        "seconds": round(sum(row["seconds"] for row in history), 1),
        "computed_in": sorted({row["computed_in"] for row in history}),
        "compiled": any(row["compiled"] for row in history),
    }


def said_of_training(results: dict[str, Any]) -> str:
    """A warning where figures are of meshes that were trained on; else nothing."""
    found = [f"{count} of the meshes of {split}" for split, count in results["trained_on"].items() if count]
    return f"; {' and '.join(found)} were trained on" if found else ""
