"""Results from counts: counts are added, and divided once at the end."""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float64, Int


@dataclass
class Confusion:
    """Weights by true class (rows) and predicted class (columns), and the sum of per-mesh accuracies."""

    classes: int
    counts: Float64[np.ndarray, "K K"] = field(init=False)
    areas: Float64[np.ndarray, "K K"] = field(init=False)
    mesh_accuracies: list[float] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.counts = np.zeros((self.classes, self.classes))
        self.areas = np.zeros((self.classes, self.classes))

    def add(
        self, truth: Int[np.ndarray, " n"], predicted: Int[np.ndarray, " n"], areas: np.ndarray | None = None
    ) -> None:
        """Count one mesh: its faces, or itself. Truth -1 is left out. `areas`: weight of each face, default 1."""
        known = truth >= 0
        truth, predicted = truth[known], predicted[known]
        weights = np.ones(len(truth)) if areas is None else areas[known]
        cell = truth.astype(np.int64) * self.classes + predicted
        shape = self.counts.shape
        self.counts += np.bincount(cell, minlength=self.classes**2).reshape(shape)
        self.areas += np.bincount(cell, weights, minlength=self.classes**2).reshape(shape)
        if len(truth):
            self.mesh_accuracies.append(float((truth == predicted).mean()))

    def merge(self, other: "Confusion") -> None:
        """Add what another has counted."""
        self.counts += other.counts
        self.areas += other.areas
        self.mesh_accuracies += other.mesh_accuracies

    def accuracy(self) -> float:
        """Right ones over all, in 0..1; NaN where nothing was counted."""
        return _ratio(np.trace(self.counts), self.counts.sum())

    def area_accuracy(self) -> float:
        """Right area over all area."""
        return _ratio(np.trace(self.areas), self.areas.sum())

    def class_iou(self) -> list[float]:
        """Intersection over union of each class; NaN for a class that is neither there nor predicted."""
        hit = np.diag(self.counts)
        union = self.counts.sum(axis=0) + self.counts.sum(axis=1) - hit
        return [_ratio(h, u) for h, u in zip(hit, union, strict=True)]

    def summary(self) -> dict[str, float]:
        """The figures of a results table."""
        found = [iou for iou in self.class_iou() if not np.isnan(iou)]
        return {
            "accuracy": self.accuracy(),
            "area_accuracy": self.area_accuracy(),
            "mesh_accuracy": float(np.mean(self.mesh_accuracies)) if self.mesh_accuracies else float("nan"),
            "mean_iou": float(np.mean(found)) if found else float("nan"),
        }


def _ratio(part: float, whole: float) -> float:
    return float(part / whole) if whole > 0 else float("nan")
