"""A solid put together from labelled parts."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float64, Int64
from numpy.typing import NDArray

from meshshard_prep.minicoseg.implicit import smooth_union

Distance = Callable[[NDArray[np.float64]], NDArray[np.float64]]

THIN = 0.042
"""The least radius, or half thickness, of anything drawn: what a grid must not lose."""

_STEP = 1e-5
_TETRAHEDRON = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])


@dataclass(frozen=True)
class Part:
    """One solid and the class of its surface."""

    label: int
    distance: Distance


@dataclass(frozen=True)
class Shape:
    """Union of parts, seams filled over `blend`."""

    parts: tuple[Part, ...]
    blend: float

    def value(self, points: Float64[np.ndarray, "N 3"]) -> Float64[np.ndarray, " N"]:
        """Negative inside; close to the distance near the surface."""
        return smooth_union((part.distance(points) for part in self.parts), self.blend)

    def tangent(
        self, points: Float64[np.ndarray, "N 3"]
    ) -> tuple[Float64[np.ndarray, " N"], Float64[np.ndarray, "N 3"]]:
        """Value and gradient, by differences over the corners of a small tetrahedron around each point."""
        around = self.value((points[:, None] + _STEP * _TETRAHEDRON).reshape(-1, 3)).reshape(-1, 4)
        return around.mean(axis=1), around @ _TETRAHEDRON / (4 * _STEP)

    def labels(self, points: Float64[np.ndarray, "N 3"]) -> Int64[np.ndarray, " N"]:
        """Class of the part whose solid is nearest, or reaches deepest."""
        nearest = np.argmin([part.distance(points) for part in self.parts], axis=0)
        return np.array([part.label for part in self.parts], dtype=np.int64)[nearest]

    def apart(self) -> tuple["Shape", "Shape"]:
        """The parts of the highest class that occurs, and the rest, as two solids."""
        last = max(part.label for part in self.parts)
        loose = tuple(part for part in self.parts if part.label == last)
        rest = tuple(part for part in self.parts if part.label != last)
        return replace(self, parts=loose), replace(self, parts=rest)
