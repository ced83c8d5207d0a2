"""Damage done on purpose to a closed mesh with labelled faces."""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Surface = tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.int64]]
"""Vertices (V, 3), faces (F, 3), and the class of each face (F,)."""


def cut_open(surface: Surface, rng: np.random.Generator) -> Surface:
    """Without the underside, without the top, or with a hole in the side of the largest part."""
    vertices, faces, labels = surface
    kind = rng.integers(3)
    if kind == 2:
        whole = np.unique(faces[labels == np.bincount(labels).argmax()])
        middle = rng.choice(whole)
        normals = _vertex_normals(vertices, faces)
        near = np.linalg.norm(vertices - vertices[middle], axis=1) < rng.uniform(0.05, 0.09)
        gone = near & (normals @ normals[middle] > 0)
    else:
        height = vertices[:, 1] if kind == 0 else -vertices[:, 1]
        gone = height < height.min() + 0.02
    kept = ~gone[faces].any(axis=1)
    while len(pinched := _pinched(faces[kept])):
        kept &= ~np.isin(faces, pinched).any(axis=1)
    used, renumbered = np.unique(faces[kept], return_inverse=True)
    return vertices[used], renumbered.reshape(-1, 3), labels[kept]


def _pinched(faces: NDArray[np.int64]) -> NDArray[np.int64]:
    """Vertices where the border meets itself; `faces` has no edge of more than two faces."""
    edges = np.sort(np.concatenate([faces[:, :2], faces[:, 1:], faces[:, ::2]]), axis=1)
    edges, uses = np.unique(edges, axis=0, return_counts=True)
    ends, borders = np.unique(edges[uses == 1], return_counts=True)
    return ends[borders > 2]


def add_fin(surface: Surface, rng: np.random.Generator) -> Surface:
    """A strip of faces that stands on a path of edges, each of which has three faces then."""
    vertices, faces, labels = surface
    normals = _vertex_normals(vertices, faces)
    path = _path(vertices, faces, int(rng.integers(len(vertices))), rng.normal(size=3), steps=int(rng.integers(4, 8)))
    crest = vertices[path] + rng.uniform(0.06, 0.1) * normals[path]
    low, high = np.array(path), len(vertices) + np.arange(len(path))
    fin = np.concatenate(
        [np.column_stack([low[:-1], low[1:], high[:-1]]), np.column_stack([low[1:], high[1:], high[:-1]])]
    )
    beside = [labels[(faces == i).any(axis=1) & (faces == j).any(axis=1)][0] for i, j in pairwise(path)]
    return np.concatenate([vertices, crest]), np.concatenate([faces, fin]), np.concatenate([labels, beside, beside])


def _path(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], start: int, heading: NDArray[np.float64], steps: int
) -> list[int]:
    """Vertices joined by edges from the start on, each time that neighbour which lies farthest along the heading."""
    path = [start]
    while len(path) <= steps:
        around = np.setdiff1d(faces[(faces == path[-1]).any(axis=1)], path)
        path.append(int(around[np.argmax((vertices[around] - vertices[path[-1]]) @ heading)]))
    return path


def _vertex_normals(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.float64]:
    """Unit means of the normals of the faces around, weighted by area."""
    first, second, third = vertices[faces].transpose(1, 0, 2)
    normals = np.zeros_like(vertices)
    for corner in faces.T:
        np.add.at(normals, corner, np.cross(second - first, third - first))
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)
