"""A training run as data: recipes are functions that return a complete, frozen configuration."""

import json
from dataclasses import asdict, dataclass, fields
from typing import Any

from meshshard.errors import UsageError

TASKS = ("segmentation", "classification")
SCALINGS = ("log-standard", "min-max")
PRECISIONS = ("auto", "bf16", "fp32")
FEATURES = {"vertices": 3, "vertex_normals": 3, "dihedral": 1, "hks": None, "dihedral_official": 3}
"""Features a network can take, and their channels (None: as many as the shard has times)."""


@dataclass(frozen=True, kw_only=True)
class TrainConfig:
    """Everything that decides the numbers of a run, but data and hardware.

    `scaling`: "log-standard" (logarithm of the HKS; HKS and dihedral to mean 0, deviation 1 in each mesh and
    channel) or "min-max" (to 0..1 in each mesh and channel, as published). `batch_vertices`: meshes are packed until
    their vertices would exceed it. `rotation_axes`: a mesh is turned by a random number of quarter turns about one
    of these axes, drawn anew each epoch; "" for none. `precision`: "bf16", "fp32", or "auto": bf16 where the
    processor computes in it.
    """

    recipe: str
    task: str
    features: tuple[str, ...] = ("vertices", "vertex_normals", "dihedral", "hks")
    scaling: str = "log-standard"
    epochs: int = 60
    warmup_epochs: float = 3.0
    learning_rate: float = 2e-3
    weight_decay: float = 0.05
    label_smoothing: float = 0.1
    drop_path: float = 0.1
    batch_vertices: int = 2048
    rotation_axes: str = "y"
    precision: str = "auto"
    seed: int = 0

    def __post_init__(self) -> None:
        known = bool(self.features) and all(name in FEATURES for name in self.features)
        rules = {
            "task": (self.task in TASKS, f"one of {', '.join(TASKS)}"),
            "features": (known, f"some of {', '.join(FEATURES)}"),
            "scaling": (self.scaling in SCALINGS, f"one of {', '.join(SCALINGS)}"),
            "epochs": (self.epochs >= 1, "1 or more"),
            "warmup_epochs": (self.warmup_epochs >= 0, "0 or more"),
            "learning_rate": (self.learning_rate > 0, "above 0"),
            "weight_decay": (self.weight_decay >= 0, "0 or more"),
            "label_smoothing": (0 <= self.label_smoothing < 1, "at least 0 and below 1"),
            "drop_path": (0 <= self.drop_path < 1, "at least 0 and below 1"),
            "batch_vertices": (self.batch_vertices >= 1, "1 or more"),
            "rotation_axes": (set(self.rotation_axes) <= set("xyz"), "some of x, y, z, or none"),
            "precision": (self.precision in PRECISIONS, f"one of {', '.join(PRECISIONS)}"),
            "seed": (self.seed >= 0, "0 or more"),
        }
        for name, (holds, allowed) in rules.items():
            if not holds:
                raise UsageError(f"training setting {name} is {allowed}, not {getattr(self, name)!r}")

    def to_json(self) -> str:
        """One canonical line."""
        return json.dumps(asdict(self), sort_keys=True, separators=(",", ":"))

    @classmethod
    def from_json(cls, text: str) -> "TrainConfig":
        """What `to_json` wrote; unknown keys are refused."""
        table = json.loads(text)
        unknown = sorted(set(table) - {f.name for f in fields(cls)})
        if unknown:
            raise UsageError(f"unknown training settings {unknown}")
        return cls(**{**table, "features": tuple(table["features"])})

    def differences(self, other: "TrainConfig") -> list[str]:
        """One line for each setting that two configurations do not share."""
        mine, theirs = asdict(self), asdict(other)
        return [f"{name}: {mine[name]!r} against {theirs[name]!r}" for name in mine if mine[name] != theirs[name]]


def paper(task: str, **overrides: Any) -> TrainConfig:
    """The article's network and inputs, chosen on validation, with a schedule that fits two processor cores.

    All features for both tasks (the published code leaves HKS and dihedral out of classification). Learning rate,
    weight decay, scaling and length of the schedule are ours: see docs/decisions/0004-training-recipe.md.
    """
    classification: dict[str, Any] = {"batch_vertices": 1024, "learning_rate": 1e-3, "rotation_axes": "xyz"}
    return TrainConfig(recipe="paper", task=task, **(classification if task == "classification" else {}) | overrides)


RECIPES = {"paper": paper}
