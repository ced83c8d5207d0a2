"""A training run as data: one frozen table of settings. Recipes, which make them: recipes.py."""

import json
import math
from dataclasses import asdict, dataclass, fields

from meshshard.errors import UsageError

TASKS = ("segmentation", "vertex_segmentation", "classification", "correspondence")
SCALINGS = ("log-standard", "log-area", "min-max")
NORMALISATIONS = ("layer", "batch", "group", "instance", "instance_area", "grn")
BACKBONES = ("mlp_residual", "mlp", "conv_residual", "conv")
SCHEDULES = ("cosine", "constant")
SELECTIONS = ("validation", "test")
VOTES = ("classes", "probabilities")
PRECISIONS = ("auto", "bf16", "fp32")
VOTED = ("segmentation", "vertex_segmentation")
"""Tasks with majority voting."""
PUBLISHED_PROTOCOL = "published protocol: epoch chosen on TEST"
"""Stands wherever a figure of such a run is shown."""
FEATURES = {
    "vertices": 3,
    "vertex_normals": 3,
    "dihedral": 1,
    "hks": None,
    "geodesic": 10,
    "shape_diameter": 2,
    "dihedral_signed": 1,
    "dihedral_official": 3,
}
"""Features a network can take, and their channels (None: as many as the shard has times)."""


@dataclass(frozen=True, kw_only=True)
class TrainConfig:
    """Everything that decides the numbers of a run, but data and hardware.

    Network. `normalisation`: layer, batch, group, instance, instance_area (each vertex weighed by its area), or grn
    (global response). `backbone`: mlp_residual as published, or one of its ablations. `width`: channels of its first
    stages, 256 as published; the later ones have twice as many. `coordinates`: functional coordinates of a vertex,
    for correspondence, where functional maps are between the lowest `eigenfunctions` and `map_regularisation` weighs
    that they commute with the Laplacians of meshes of area 1.
    Input. `scaling`: "log-standard" (logarithms of HKS, geodesic and shape diameter; all but positions and normals to
    mean 0, deviation 1 in each mesh and channel), "log-area" (the same, each vertex weighed by its area: where a mesh
    has many vertices does not matter) or "min-max" (to 0..1 in each mesh and channel, as published).
    `vertex_fraction`: of the vertices of a training mesh, so many are computed in a step (see drawn.py); 1: all.
    Normalisations over a mesh are then over these.
    `rotation_axes`: a mesh is turned by a random number of quarter turns about one of these axes, drawn anew each
    epoch; "" for none. `train_fraction`: of the training meshes, for few-shot learning; subsets of one seed are
    nested.
    Steps. `passes`: how often an epoch goes over the training meshes: more where they are few, so that judging does
    not cost most. `batch_vertices`: meshes are packed until their vertices, all of them, would exceed it;
    `batch_meshes`: until they are so many, 0 for no such limit. `schedule`: after the warm-up, cosine to 0 or
    constant. `clip_norm`: longest gradient, 0 for no limit. `ema`: decay of the moving average of the weights that is
    evaluated and kept, 0 for none.
    Choice. `selection`: the split that chooses the epoch; "test" is the published protocol, and is named wherever its
    figures are shown. `voting_rounds`: fixed, or -1: chosen on validation. `votes`: "classes", as published, or
    "probabilities" (see voting.py); `votes_itself`: a face's own is one of the votes, which the published code leaves
    out. `patience`: epochs without a better one after which a run ends, 0 for never.
    `precision`: "bf16", "fp32", or "auto": bf16 where the processor computes in it.
    """

    recipe: str
    task: str
    features: tuple[str, ...] = ("vertices", "vertex_normals", "dihedral", "hks")
    scaling: str = "log-standard"
    normalisation: str = "layer"
    backbone: str = "mlp_residual"
    width: int = 256
    coordinates: int = 30
    eigenfunctions: int = 30
    map_regularisation: float = 1e-6
    epochs: int = 60
    passes: int = 1
    warmup_epochs: float = 3.0
    schedule: str = "cosine"
    learning_rate: float = 2e-3
    weight_decay: float = 0.05
    label_smoothing: float = 0.1
    drop_path: float = 0.1
    clip_norm: float = 0.0
    ema: float = 0.0
    batch_vertices: int = 4096
    batch_meshes: int = 0
    rotation_axes: str = "y"
    train_fraction: float = 1.0
    vertex_fraction: float = 1.0
    selection: str = "validation"
    voting_rounds: int = -1
    votes: str = "classes"
    votes_itself: bool = True
    patience: int = 0
    precision: str = "auto"
    seed: int = 0

    def __post_init__(self) -> None:
        known = bool(self.features) and all(name in FEATURES for name in self.features)
        known = known and len(set(self.features)) == len(self.features)
        rules = {
            "task": (self.task in TASKS, f"one of {', '.join(TASKS)}"),
            "features": (known, f"some of {', '.join(FEATURES)}, each once"),
            "scaling": (self.scaling in SCALINGS, f"one of {', '.join(SCALINGS)}"),
            "normalisation": (self.normalisation in NORMALISATIONS, f"one of {', '.join(NORMALISATIONS)}"),
            "backbone": (self.backbone in BACKBONES, f"one of {', '.join(BACKBONES)}"),
            "width": (16 <= self.width <= 4096 and self.width % 16 == 0, "a multiple of 16, from 16 to 4096"),
            "coordinates": (self.coordinates >= 1, "1 or more"),
            "eigenfunctions": (self.eigenfunctions >= 1, "1 or more"),
            "map_regularisation": (self.map_regularisation > 0, "above 0"),
            "epochs": (1 <= self.epochs <= 10**6, "from 1 to a million"),
            "passes": (1 <= self.passes <= 10**6, "from 1 to a million"),
            "warmup_epochs": (self.warmup_epochs >= 0, "0 or more"),
            "schedule": (self.schedule in SCHEDULES, f"one of {', '.join(SCHEDULES)}"),
            "learning_rate": (self.learning_rate > 0, "above 0"),
            "weight_decay": (self.weight_decay >= 0, "0 or more"),
            "label_smoothing": (0 <= self.label_smoothing < 1, "at least 0 and below 1"),
            "drop_path": (0 <= self.drop_path < 1, "at least 0 and below 1"),
            "clip_norm": (self.clip_norm >= 0, "0 or more"),
            "ema": (0 <= self.ema < 1, "at least 0 and below 1"),
            "batch_vertices": (self.batch_vertices >= 1, "1 or more"),
            "batch_meshes": (self.batch_meshes >= 0, "0 or more"),
            "rotation_axes": (set(self.rotation_axes) <= set("xyz"), "some of x, y, z, or none"),
            "train_fraction": (0 < self.train_fraction <= 1, "above 0 and at most 1"),
            "vertex_fraction": (0 < self.vertex_fraction <= 1, "above 0 and at most 1"),
            "selection": (self.selection in SELECTIONS, f"one of {', '.join(SELECTIONS)}"),
            "voting_rounds": (self.voting_rounds >= -1, "0 or more, or -1: chosen on validation"),
            "votes": (self.votes in VOTES, f"one of {', '.join(VOTES)}"),
            "patience": (self.patience >= 0, "0 or more"),
            "precision": (self.precision in PRECISIONS, f"one of {', '.join(PRECISIONS)}"),
            "seed": (0 <= self.seed < 2**63, "0 or more, and below 2^63"),
        }
        for name, (holds, allowed) in rules.items():
            value = getattr(self, name)
            if not holds or (isinstance(value, float) and not math.isfinite(value)):
                raise UsageError(f"training setting {name} is {allowed}, not {value!r}")
        if self.vertex_fraction < 1 and (self.task == "correspondence" or self.convolves):
            raise UsageError(
                "training setting vertex_fraction below 1 needs a network without convolutions (backbone "
                f"mlp_residual or mlp) and classes to learn, not {self.backbone} and {self.task}"
            )
        if self.selection == "test" and self.voting_rounds < 0 and self.task in VOTED:
            raise UsageError("training setting selection = test needs voting_rounds: nothing else chooses them")

    @property
    def pointwise(self) -> bool:
        """Whether what the network says of a vertex depends on that vertex alone."""
        return self.normalisation == "layer" and not self.convolves

    @property
    def convolves(self) -> bool:
        """Whether layers look at the vertices before and after one."""
        return self.backbone in ("conv_residual", "conv")

    @property
    def protocol(self) -> str:
        """How epoch and voting rounds are chosen, in words that go with every figure."""
        if self.selection == "test":
            return PUBLISHED_PROTOCOL
        if self.voting_rounds < 0 and self.task in VOTED:
            return "epoch and rounds of voting chosen on validation"
        return "epoch chosen on validation"

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
