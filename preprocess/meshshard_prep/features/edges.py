"""Edges of a triangle mesh, numbered as they are met."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float64, Int64


@dataclass(frozen=True, eq=False)
class Edges:
    """`ends` (E,2): smaller and larger vertex; `of_face` (F,3): edges (0,1), (1,2), (2,0); `count` (E,): faces at it.

    Numbered when first met while walking the faces in order: MeshCNN's order, which its edge labels follow.
    """

    ends: Int64[np.ndarray, "E 2"]
    of_face: Int64[np.ndarray, "F 3"]
    count: Int64[np.ndarray, " E"]

    @cached_property
    def pairs(self) -> tuple[Int64[np.ndarray, " P"], Int64[np.ndarray, "P 2"]]:
        """Interior edges, those with exactly two faces: their numbers and their two half-edges (3 * face + side)."""
        sides = np.argsort(self.of_face.ravel(), kind="stable")
        interior = np.flatnonzero(self.count == 2)
        first = (np.cumsum(self.count) - self.count)[interior]
        return interior, np.stack([sides[first], sides[first + 1]], axis=1)


def edges_of(faces: Int64[np.ndarray, "F 3"]) -> Edges:
    """The edges of triangles. A repeated corner gives an edge from a vertex to itself."""
    tails, heads = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    low, high = np.minimum(tails, heads), np.maximum(tails, heads)
    span = int(faces.max()) + 1 if len(faces) else 1
    _, first, inverse, count = np.unique(
        low * span + high, return_index=True, return_inverse=True, return_counts=True
    )
    met = np.argsort(first)
    rank = np.empty_like(met)
    rank[met] = np.arange(len(met))
    ends = np.stack([low[first[met]], high[first[met]]], axis=1)
    return Edges(ends, rank[inverse].reshape(-1, 3), count[met])


def mean_at_ends(
    ends: Int64[np.ndarray, "P 2"], values: Float64[np.ndarray, " P"], vertices: int
) -> Float64[np.ndarray, " V"]:
    """Mean at each vertex of the values of edges that end there; 0 where none does."""
    total = np.bincount(ends.ravel(), np.repeat(values, 2), minlength=vertices)
    count = np.bincount(ends.ravel(), minlength=vertices)
    return total / np.maximum(count, 1)
