"""Results from counts: counts are added, and divided once at the end. What each figure means: docs/metrics.md."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from jaxtyping import Float, Float64, Int

from meshshard_train.config import PUBLISHED_PROTOCOL

FIGURES = {
    "segmentation": (
        "accuracy",
        "area_accuracy",
        "mesh_accuracy",
        "edge_accuracy",
        "class_accuracy",
        "mean_iou",
        "mean_dice",
    ),
    "vertex_segmentation": ("accuracy", "area_accuracy", "mesh_accuracy", "class_accuracy", "mean_iou", "mean_dice"),
    "classification": ("accuracy", "class_accuracy"),
}
"""Task -> the figures of a results table, in order."""
CLASS_FIGURES = ("accuracy", "iou", "dice", "mesh_iou", "mesh_dice")
"""The figures of one class; `mesh_*` are means over meshes."""


@dataclass
class Confusion:
    """Weights by true class (rows) and predicted class (columns), and what is averaged over meshes: of each mesh and
    class what is right, what it is in truth and what is predicted; the share of edges that are right."""

    classes: int
    counts: Float64[np.ndarray, "K K"] = field(init=False)
    areas: Float64[np.ndarray, "K K"] = field(init=False)
    meshes: list[Float64[np.ndarray, "3 K"]] = field(default_factory=list)
    edges: list[float] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.counts = np.zeros((self.classes, self.classes))
        self.areas = np.zeros((self.classes, self.classes))

    def add(
        self,
        truth: Int[np.ndarray, " n"],
        predicted: Int[np.ndarray, " n"],
        areas: Float[np.ndarray, " n"] | None = None,
        adjacency: Int[np.ndarray, "n 3"] | None = None,
    ) -> None:
        """Count one mesh: its faces, its vertices, or itself. Truth -1 is left out. `areas`: weight of each, default
        1. `adjacency`: face across each edge, -1 for none; given, edges are counted."""
        weights = np.ones(len(truth)) if areas is None else areas
        if adjacency is not None and not math.isnan(share := edge_accuracy(truth, predicted, weights, adjacency)):
            self.edges.append(share)
        known = truth >= 0
        cell = truth[known].astype(np.int64) * self.classes + predicted[known]
        counts, sizes = (
            np.bincount(cell, weight, minlength=self.classes**2).reshape(self.counts.shape)
            for weight in (None, weights[known])
        )
        self.counts += counts
        self.areas += sizes
        if known.any():
            self.meshes.append(np.stack([np.diag(counts), counts.sum(axis=1), counts.sum(axis=0)]).astype(float))

    def merge(self, other: "Confusion") -> None:
        """Add what another has counted."""
        self.counts += other.counts
        self.areas += other.areas
        self.meshes += other.meshes
        self.edges += other.edges

    def accuracy(self) -> float:
        """Right ones over all, in 0..1; NaN where nothing was counted."""
        return float(_ratio(np.trace(self.counts), self.counts.sum()))

    def summary(self) -> dict[str, float]:
        """All figures of a results table, in 0..1; NaN for what was not counted."""
        of_class = self.of_classes()
        return {
            "accuracy": self.accuracy(),
            "area_accuracy": float(_ratio(np.trace(self.areas), self.areas.sum())),
            "mesh_accuracy": _mean([hit.sum() / true.sum() for hit, true, _ in self.meshes]),
            "edge_accuracy": _mean(self.edges),
            "class_accuracy": _mean(of_class["accuracy"]),
            "mean_iou": _mean(of_class["iou"]),
            "mean_dice": _mean(of_class["dice"]),
        }

    def of_classes(self) -> dict[str, list[float]]:
        """CLASS_FIGURES of each class. NaN for the accuracy of a class that is not there, and for the others of one
        that is not predicted either."""
        hit, true, predicted = np.diag(self.counts), self.counts.sum(axis=1), self.counts.sum(axis=0)
        found = {"accuracy": _ratio(hit, true)} | _overlaps(hit, true, predicted)
        meshes = np.stack(self.meshes, axis=1) if self.meshes else np.zeros((3, 0, self.classes))
        for name, ratios in _overlaps(*meshes).items():
            found[f"mesh_{name}"] = np.array([_mean(of_meshes) for of_meshes in ratios.T])
        return {name: found[name].tolist() for name in CLASS_FIGURES}


def edge_accuracy(
    truth: Int[np.ndarray, " F"],
    predicted: Int[np.ndarray, " F"],
    areas: Float[np.ndarray, " F"],
    adjacency: Int[np.ndarray, "F 3"],
) -> float:
    """Share of right edges of a mesh, as MeshCNN counts them: an edge weighs a third of the area of its faces, and a
    prediction is right that is the true class of one of them. Each face predicts for its own third.

    NaN where no face is labelled; faces that are not are left out. Source: `seg_accuracy` and `build_gemm` of MeshCNN
    (Hanocka et al. 2019); where it differs: docs/metrics.md.
    """
    across = np.where(adjacency >= 0, truth[adjacency], -1)
    right = (predicted == truth)[:, None] | (predicted[:, None] == across)
    weights = areas * (truth >= 0)
    return float(_ratio(weights @ right.mean(axis=1), weights.sum()))


def judged(row: Mapping[str, Any]) -> tuple[str, float]:
    """What a line of metrics.jsonl is judged by: its name in words, with split and protocol, and its value."""
    split, figure = row["judged_by"].replace("_voted", "").split("_", 1)
    kind = (", voted" if "_voted_" in row["judged_by"] else ", raw") * (figure == "accuracy")
    protocol = f" ({PUBLISHED_PROTOCOL})" * (row["protocol"] == PUBLISHED_PROTOCOL)
    return f"{split} {figure.replace('_', ' ')}{kind}{protocol}", row[row["judged_by"]]


def _overlaps(hit: np.ndarray, true: np.ndarray, predicted: np.ndarray) -> dict[str, np.ndarray]:
    return {"iou": _ratio(hit, true + predicted - hit), "dice": _ratio(2 * hit, true + predicted)}


def _ratio(part: Any, whole: Any) -> np.ndarray:
    """NaN where the whole is 0."""
    nan = np.full(np.shape(whole), np.nan)
    return np.divide(part, whole, out=nan, where=np.asarray(whole) > 0)


def _mean(values: Sequence[float] | Float64[np.ndarray, " n"]) -> float:
    """Of those that are numbers, the same in whatever order they come; NaN without any."""
    found = [value for value in np.asarray(values).tolist() if not math.isnan(value)]
    return math.fsum(found) / len(found) if found else math.nan
