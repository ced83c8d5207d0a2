"""Signed distance functions of simple solids: negative inside, zero on the surface, positive outside.

Each takes points, y up, and gives their distances; all are exact unless the docstring says otherwise. Where there is
a `turn`, its columns are the solid's own axes. The formulas of round cone, ellipsoid, polygon and smooth minimum are
Inigo Quilez's (https://iquilezles.org/articles).
"""

from collections.abc import Iterable

import numpy as np
from jaxtyping import Float64
from numpy.typing import NDArray


def ellipsoid(
    points: Float64[np.ndarray, "N 3"],
    centre: Float64[np.ndarray, "3"],
    radii: Float64[np.ndarray, "3"],
    turn: Float64[np.ndarray, "3 3"] | None = None,
) -> Float64[np.ndarray, " N"]:
    """Exact for a ball; otherwise right in sign and zero set, and of first order at the surface."""
    local = _own_axes(points - centre, turn)
    scaled = np.linalg.norm(local / radii, axis=1)
    slope = np.linalg.norm(local / radii**2, axis=1)
    near_centre = slope < 1e-12
    outside = scaled * (scaled - 1) / np.where(near_centre, 1.0, slope)
    return np.where(near_centre, -radii.min(), outside)


def box(
    points: Float64[np.ndarray, "N 3"],
    centre: Float64[np.ndarray, "3"],
    half: Float64[np.ndarray, "3"],
    rounding: float,
    turn: Float64[np.ndarray, "3 3"] | None = None,
) -> Float64[np.ndarray, " N"]:
    """Box of half sizes `half`, edges rounded inwards by `rounding`."""
    beyond = np.abs(_own_axes(points - centre, turn)) - (half - rounding)
    return np.linalg.norm(np.maximum(beyond, 0), axis=1) + np.minimum(beyond.max(axis=1), 0) - rounding


def disc(
    points: Float64[np.ndarray, "N 3"],
    centre: Float64[np.ndarray, "3"],
    radius: float,
    half: float,
    rounding: float,
) -> Float64[np.ndarray, " N"]:
    """Upright cylinder of half height `half`, rims rounded inwards by `rounding`."""
    local = points - centre
    beyond = np.stack([np.hypot(local[:, 0], local[:, 2]) - radius, np.abs(local[:, 1]) - half], axis=1) + rounding
    return np.linalg.norm(np.maximum(beyond, 0), axis=1) + np.minimum(beyond.max(axis=1), 0) - rounding


def round_cone(
    points: Float64[np.ndarray, "N 3"],
    start: Float64[np.ndarray, "3"],
    end: Float64[np.ndarray, "3"],
    start_radius: float,
    end_radius: float,
) -> Float64[np.ndarray, " N"]:
    """Hull of two balls, neither inside the other; equal radii make a capsule."""
    axis, local = end - start, points - start
    length2, taper = axis @ axis, start_radius - end_radius
    slant2 = length2 - taper**2
    along = local @ axis
    past = along - length2
    across2 = np.square(local * length2 - np.outer(along, axis)).sum(axis=1)
    along2, past2 = along**2 * length2, past**2 * length2
    bend = np.sign(taper) * taper**2 * across2
    side = (np.sqrt(across2 * slant2 / length2) + along * taper) / length2 - start_radius
    near_start = np.sqrt(across2 + along2) / length2 - start_radius
    near_end = np.sqrt(across2 + past2) / length2 - end_radius
    return np.where(
        np.sign(past) * slant2 * past2 > bend,
        near_end,
        np.where(np.sign(along) * slant2 * along2 < bend, near_start, side),
    )


def tube(
    points: Float64[np.ndarray, "N 3"], path: Float64[np.ndarray, "P 3"], radii: Float64[np.ndarray, " P"]
) -> Float64[np.ndarray, " N"]:
    """Round cones along a polyline, exact outside."""
    pieces = (
        round_cone(points, path[i], path[i + 1], float(radii[i]), float(radii[i + 1])) for i in range(len(path) - 1)
    )
    return np.minimum.reduce(list(pieces))


def revolved(
    points: Float64[np.ndarray, "N 3"], profile: Float64[np.ndarray, "P 2"], rounding: float
) -> Float64[np.ndarray, " N"]:
    """Solid of revolution about the y axis, grown by `rounding`; a negative one shrinks it, then inexact at edges.

    `profile` is a line of (radius, y) from bottom to top; the flat discs of its two ends close the solid.
    """
    far = 2 * profile[:, 0].max() + 1.0  # beyond the axis, so that no edge of the polygon lies inside the solid
    polygon = np.concatenate([profile, [[-far, profile[-1, 1]], [-far, profile[0, 1]]]])
    radius, height = np.hypot(points[:, 0], points[:, 2]), points[:, 1]
    nearest2 = np.full(len(points), np.inf)
    inside = np.zeros(len(points), dtype=bool)
    for corner, before in zip(polygon, np.roll(polygon, 1, axis=0), strict=True):
        (out, up), right, above = before - corner, radius - corner[0], height - corner[1]
        share = np.clip((right * out + above * up) / (out**2 + up**2), 0, 1)
        nearest2 = np.minimum(nearest2, (right - share * out) ** 2 + (above - share * up) ** 2)
        upward = (height >= corner[1]) & (height < before[1])
        downward = (height < corner[1]) & (height >= before[1])
        left = out * above > up * right
        inside ^= (upward & left) | (downward & ~left)
    return np.where(inside, -1.0, 1.0) * np.sqrt(nearest2) - rounding


def smooth_union(distances: Iterable[Float64[np.ndarray, " N"]], blend: float) -> Float64[np.ndarray, " N"]:
    """Union whose seams are filled where two solids are within `blend` of each other; not a distance there."""
    first, *others = distances
    for other in others:
        overlap = np.maximum(blend - np.abs(first - other), 0)
        first = np.minimum(first, other) - overlap**2 / (4 * blend)
    return first


def _own_axes(local: NDArray[np.float64], turn: NDArray[np.float64] | None) -> NDArray[np.float64]:
    return local if turn is None else local @ turn
