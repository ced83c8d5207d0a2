"""What goes with the figures of a run: of which data, settings and checkpoint they are."""

import json
from collections.abc import Sequence
from typing import Any

from meshshard import Dataset
from meshshard_train.checkpoint import Checkpoint
from meshshard_train.members import JUDGES, keys_of


def facts_of(best: Checkpoint, dataset: Dataset, splits: Sequence[str]) -> dict[str, Any]:
    """Keys of results.json that every task has. `meshes_trained`: how many the run learned from; `trained_on`: of
    each split, how many of its meshes are among them; `chosen_by`: or chose the epoch, where that is another split.

    Meshes are known by their content, so that it does not matter in which data set or split they are now.
    """
    learned, judges = set(best.state["trained"]), set(best.state["judges"])
    shown = {split: set(keys_of(dataset, dataset.splits.get(split, ()))) for split in splits}
    others = {split: keys for split, keys in shown.items() if split != JUDGES[best.config.selection]}
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
        "meshes_trained": len(best.state["trained"]),
        "trained_on": {split: len(learned & keys) for split, keys in shown.items()},
        "chosen_by": {split: len(judges & keys) for split, keys in others.items()},
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
    """A warning where figures are of meshes that were trained on, or that chose the epoch; else nothing."""
    said = ""
    for key, words in (("trained_on", "were trained on"), ("chosen_by", "chose the epoch")):
        found = [f"{count} of the meshes of {split}" for split, count in results[key].items() if count]
        said += f"; {' and '.join(found)} {words}" if found else ""
    return said
