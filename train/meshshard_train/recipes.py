"""Recipes: functions that return a complete configuration of a training run."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from meshshard.errors import UsageError
from meshshard_train.config import VOTED, TrainConfig


def paper(task: str, **overrides: Any) -> TrainConfig:
    """The article's network and inputs, chosen on validation, with a schedule that fits two processor cores.

    All features for both tasks (the published code leaves HKS and dihedral out of classification). Learning rate,
    weight decay, scaling and length of the schedule are ours: see docs/decisions/0004-training-recipe.md.
    """
    of_task: dict[str, dict[str, Any]] = {
        "classification": {"batch_vertices": 1024, "learning_rate": 1e-3, "rotation_axes": "xyz"},
        "correspondence": {"rotation_axes": ""},
    }
    return TrainConfig(recipe="paper", task=task, **of_task.get(task, {}) | overrides)


def official(task: str, **overrides: Any) -> TrainConfig:
    """The published code: its inputs, schedule, voting, and its choice of the epoch on the TEST split.

    Trains on train and validation together. Segmentation needs shards of the feature recipe `official`.
    Voting: 3 rounds (20 for COSEG's aliens and 15 for its vases there: --set voting_rounds=20). UsageError for
    correspondence, whose published schedule is not known.
    """
    if task == "correspondence":
        raise UsageError("there is no recipe official for correspondence: its published schedule is not known")
    settings: dict[str, Any] = {
        "scaling": "min-max",
        "learning_rate": 3e-4,
        "batch_meshes": 3,
        "batch_vertices": 2**31,
        "selection": "test",
        "precision": "fp32",
        "rotation_axes": "y",
    }
    if task == "classification":
        settings |= {
            "features": ("vertices", "vertex_normals"),
            "weight_decay": 0.05,
            "epochs": 1000,
            "schedule": "constant",
            "warmup_epochs": 0.0,
        }
    else:
        settings |= {
            "features": ("vertices", "vertex_normals", "dihedral_official", "hks"),
            "weight_decay": 0.3,
            "epochs": 1000,
            "warmup_epochs": 20.0,
            "voting_rounds": 3,
            "votes_itself": False,
        }
    return TrainConfig(recipe="official", task=task, **settings | overrides)


def fast(task: str, **overrides: Any) -> TrainConfig:
    """The best accuracy in half an hour on two processor cores, for some hundreds of meshes of 750 vertices: features
    that no turn changes, of the feature recipe `best`, scaled over the surface, and an average of weights. With two
    deformed copies of each training mesh a third of the epochs take as long, and learn more.

    Figures and what was tried: docs/decisions/0017-recipe-fast.md, and 0018 and 0020 there.
    """
    of_task: dict[str, dict[str, Any]] = {
        "classification": {"batch_vertices": 1024, "learning_rate": 1e-3, "epochs": 60},
    }
    settings: dict[str, Any] = {
        "features": ("dihedral", "hks", "geodesic", "shape_diameter"),
        "scaling": "log-area",
        "rotation_axes": "",
        "clip_norm": 1.0,
        "ema": 0.998,
        "epochs": 50,
    }
    return TrainConfig(recipe="fast", task=task, **settings | of_task.get(task, {}) | overrides)


def best(task: str, **overrides: Any) -> TrainConfig:
    """What we would train first: more accurate than `fast` for labels of faces and vertices, for a sixth of its
    work. Each channel normalised over the surface of a mesh, a quarter of the width, a half of each mesh a step, and
    neighbours that vote with probabilities; with six deformed copies of each training mesh. Classes of meshes are
    learned better by layer normalisation, half the width, and without copies.

    What was tried: docs/decisions/0022-recipe-best.md, and 0023 there.
    """
    of_voted: dict[str, Any] = {
        "normalisation": "instance_area",
        "width": 64,
        "batch_vertices": 8192,
        "epochs": 14,
        "warmup_epochs": 1.0,
        "schedule": "constant",
    }
    settings: dict[str, Any] = {
        "width": 128,
        "vertex_fraction": 1.0 if task == "correspondence" else 0.5,
        "votes": "probabilities",
    }
    of_task = of_voted if task in VOTED else {}
    return replace(fast(task, **settings | of_task | overrides), recipe="best")


RECIPES: dict[str, Callable[..., TrainConfig]] = {"paper": paper, "official": official, "fast": fast, "best": best}
