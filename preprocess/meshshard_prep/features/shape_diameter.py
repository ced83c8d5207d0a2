"""How thick a shape is at a vertex: the shape diameter function."""

import numpy as np
from jaxtyping import Float64, Int64

from meshshard.errors import UsageError
from meshshard_prep.features.components import members_of

RAYS = 60
HALF_ANGLE = np.pi / 3
"""Of the cone around the inward normal that rays are in."""

OFFSET = 1e-3
"""Where rays start below the surface, in square roots of its area: not on the vertex's own faces."""

OPEN = 2.0
"""Thickness, in square roots of the area, where most rays leave the shape, as on a sheet."""


def shape_diameter(
    vertices: Float64[np.ndarray, "V 3"],
    faces: Int64[np.ndarray, "F 3"],
    normals: Float64[np.ndarray, "V 3"],
    areas: Float64[np.ndarray, " V"],
    piece_of: Int64[np.ndarray, " V"],
) -> Float64[np.ndarray, "V 2"]:
    """Median, and fifth, of the lengths of RAYS rays from each vertex to the opposite side, in square roots of the
    mesh's area: from 0 to OPEN, which stands for rays that meet nothing.

    Rays go against the normals, or along them for a piece more of whose rays then meet the surface: a closed piece
    may be inside out. `normals`: unit, or 0 (its vertices are OPEN). Source: Shapira, Shamir and Cohen-Or 2008, whose
    mean of the lengths within a deviation of the median is a plain median here. Embree finds what a ray meets.
    UsageError: embreex is not installed.
    """
    unit = float(np.sqrt(areas.sum()))
    inward, outward = (_lengths((vertices - vertices.mean(axis=0)) / unit, faces, sign * normals) for sign in (-1, 1))
    for piece in members_of(piece_of):
        if (outward[piece] < OPEN).sum() > (inward[piece] < OPEN).sum():
            inward[piece] = outward[piece]
    return np.stack([np.median(inward, axis=1), np.quantile(inward, 0.2, axis=1)], axis=1)


def _lengths(
    points: Float64[np.ndarray, "V 3"], faces: Int64[np.ndarray, "F 3"], axes: Float64[np.ndarray, "V 3"]
) -> Float64[np.ndarray, "V R"]:
    """Of the rays around an axis at each vertex, in the unit of the points, whose middle is 0."""
    try:
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene
    except ImportError as error:
        raise UsageError(
            "shape_diameter needs embreex, which has no wheel here: leave it out of the recipe"
        ) from error
    scene = EmbreeScene(robust=True)
    TriangleMesh(scene, points[faces].astype(np.float32))
    ways = np.einsum("rk,vkd->vrd", cone(), _frames(axes, points))
    starts = (points + OFFSET * axes)[:, None] + np.zeros_like(ways)
    hits = scene.run(starts.reshape(-1, 3).astype(np.float32), ways.reshape(-1, 3).astype(np.float32), output=True)
    met = (hits["primID"] >= 0) & axes.any(axis=1).repeat(RAYS)
    return np.where(met, np.minimum(hits["tfar"], OPEN), OPEN).reshape(len(points), RAYS).astype(np.float64)


def cone() -> Float64[np.ndarray, "R 3"]:
    """Unit vectors spread evenly over a cap of HALF_ANGLE around the z axis, on a golden spiral."""
    number = np.arange(RAYS)
    height = 1 - (number + 0.5) / RAYS * (1 - np.cos(HALF_ANGLE))
    turn = number * np.pi * (3 - np.sqrt(5))
    return np.stack([*(np.sqrt(1 - height**2) * (np.cos(turn), np.sin(turn))), height], axis=1)


def _frames(axes: Float64[np.ndarray, "V 3"], points: Float64[np.ndarray, "V 3"]) -> Float64[np.ndarray, "V 3 3"]:
    """Orthonormal rows for each axis, itself last; zeros for one that is 0. They turn with the shape, whose middle is
    0: towards it, where the axis does not point there itself."""
    first = np.cross(axes, points + 1e-9 * np.eye(3)[np.abs(axes).argmin(axis=1)])
    first /= np.maximum(np.linalg.norm(first, axis=1, keepdims=True), np.finfo(float).tiny)
    return np.stack([first, np.cross(axes, first), axes], axis=1)
