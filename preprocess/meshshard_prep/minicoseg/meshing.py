"""Triangles for a solid: marching cubes, then one of four finishes, so that triangulations differ."""

from collections.abc import Callable
from typing import Any, Literal

import igl
import numpy as np
from jaxtyping import Float64, Int64
from numpy.typing import NDArray
from scipy import sparse
from skimage.measure import marching_cubes

from meshshard_prep.minicoseg.shape import THIN, Shape

Finish = Literal["grid", "relaxed", "uniform", "adaptive"]
"""grid: marching cubes, hardly moved. relaxed: those, evened out. uniform: a fine grid whose shortest edges are
collapsed, evened out. adaptive: such a one whose flattest places are collapsed further (quadric error)."""

FINISHES: tuple[Finish, ...] = ("grid", "relaxed", "uniform", "adaptive")
COLLAPSING: tuple[Finish, ...] = ("uniform", "adaptive")

FINE = 0.024
COARSEST = 0.9 * np.sqrt(2) * THIN
"""Cells of the grid. A round bar survives every grid whose cell is shorter than its thickness / sqrt 2."""

MOST = 1350
"""Faces beyond which marching cubes are not left as they are."""

FINE_ENOUGH = 1500
"""Faces up to which the fine grid has plenty to collapse."""

_BLOCK = 3
_ROOM = np.array([[-0.9, -0.2, -0.9], [0.9, 1.9, 0.9]])

Triangles = tuple[Float64[np.ndarray, "V 3"], Int64[np.ndarray, "F 3"]]


def triangulate(
    shape: Shape, faces: int, rng: np.random.Generator, finishes: tuple[Finish, ...] = FINISHES, most: int = MOST
) -> Triangles:
    """Closed mesh of about `faces` triangles, oriented outwards, in one of the finishes.

    A shape too large for a grid that is both safe and gives no more than `most` triangles is collapsed, whatever the
    finishes.
    """
    fine = marching(shape, FINE, rng)
    cell = min(FINE * np.sqrt(len(fine[1]) / faces), COARSEST)
    if len(fine[1]) * (FINE / cell) ** 2 > most:
        finishes = COLLAPSING
    if faces > FINE_ENOUGH:
        fine = marching(shape, FINE * np.sqrt(len(fine[1]) / (3 * faces)), rng)
    finish = finishes[rng.integers(len(finishes))]
    if finish not in COLLAPSING:
        vertices, triangles = marching(shape, cell, rng)
        return settle(shape, vertices, triangles, rounds=4, pull=0.4 if finish == "relaxed" else 0.1), triangles
    first = faces if finish == "uniform" else 2 * faces
    vertices, triangles = _collapsed(igl.decimate, settle(shape, *fine, rounds=3, pull=0.3), fine[1], first)
    vertices = settle(shape, vertices, triangles, rounds=4, pull=0.3)
    if finish == "adaptive":
        vertices, triangles = _collapsed(igl.qslim, vertices, triangles, faces)
        vertices = settle(shape, vertices, triangles, rounds=2, pull=0.2)
    return vertices, triangles


def marching(shape: Shape, cell: float, rng: np.random.Generator) -> Triangles:
    """Marching cubes on a grid of that cell, set off by a random part of it.

    The grid is cut into blocks, and only those near the surface are looked at point by point: elsewhere the sign of
    the value at a block's middle is enough.
    """
    low = _ROOM[0] - cell * rng.random(3)
    blocks = np.ceil((_ROOM[1] - low) / (_BLOCK * cell)).astype(int)
    middles = low + cell * (_BLOCK * _lattice(blocks) + (_BLOCK - 1) / 2)
    values = np.repeat(shape.value(middles)[:, None], _BLOCK**3, axis=1)
    near = np.abs(values[:, 0]) < 1.5 * np.sqrt(3) / 2 * _BLOCK * cell
    inside = cell * (_lattice(np.full(3, _BLOCK)) - (_BLOCK - 1) / 2)
    values[near] = shape.value((middles[near][:, None] + inside).reshape(-1, 3)).reshape(-1, _BLOCK**3)
    away = 0.12 * cell  # a surface through a grid point would make slivers
    values = np.where(np.abs(values) < away, np.copysign(away, values), values)
    volume = values.reshape(*blocks, *[_BLOCK] * 3).transpose(0, 3, 1, 4, 2, 5).reshape(_BLOCK * blocks)
    vertices, faces, *_ = marching_cubes(volume, 0.0)  # type: ignore[no-untyped-call]
    return low + cell * vertices.astype(np.float64), faces.astype(np.int64)


def settle(
    shape: Shape,
    vertices: Float64[np.ndarray, "V 3"],
    faces: Int64[np.ndarray, "F 3"],
    rounds: int,
    pull: float,
) -> Float64[np.ndarray, "V 3"]:
    """Newton steps onto the surface, in each of which every vertex also moves by `pull` of the way to the mean of its
    neighbours, along the surface only; two steps without pull at the end."""
    mean = _mean_of_neighbours(len(vertices), faces)
    for _ in range(rounds):
        aside = pull * (mean @ vertices - vertices)
        value, slope = shape.tangent(vertices)
        ahead = np.einsum("vc,vc->v", aside, slope)
        steepness = np.square(slope).sum(axis=1)
        vertices = vertices + aside - ((np.clip(value, -FINE, FINE) + ahead) / steepness)[:, None] * slope
    return vertices if pull == 0 else settle(shape, vertices, faces, rounds=2, pull=0.0)


def _collapsed(
    collapse: Callable[..., Any], vertices: NDArray[np.float64], faces: NDArray[np.int64], count: int
) -> Triangles:
    fewer_vertices, fewer_faces, *_ = collapse(vertices, faces, count)
    return fewer_vertices, fewer_faces.astype(np.int64)  # igl's are long long


def _lattice(counts: NDArray[np.int64]) -> NDArray[np.float64]:
    return np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), axis=-1).reshape(-1, 3).astype(np.float64)


def _mean_of_neighbours(count: int, faces: NDArray[np.int64]) -> sparse.csr_array:
    rows, columns = faces.ravel(), np.roll(faces, 1, axis=1).ravel()
    links = sparse.csr_array((np.ones(len(rows)), (rows, columns)), shape=(count, count))
    links = links + links.T
    return sparse.csr_array(sparse.diags_array(1 / links.sum(axis=1)) @ links)
