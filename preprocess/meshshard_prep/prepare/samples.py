"""Points on triangles that stand for equal shares of their areas."""

import numpy as np
from jaxtyping import Float64

SIDE = 5
POINTS = SIDE**2
"""Of each triangle: the centres of the POINTS triangles that cutting its sides in SIDE gives."""


def _weights() -> Float64[np.ndarray, "S 3"]:
    """Barycentric coordinates of the centres, that of the whole triangle first."""
    i, j = np.divmod(np.arange(SIDE * SIDE), SIDE)
    upright = i + j < SIDE  # the others are upside down, and counted from the far corner
    first = np.where(upright, 3 * i + 1, 3 * (SIDE - i) - 1)
    second = np.where(upright, 3 * j + 1, 3 * (SIDE - j) - 1)
    weights = np.stack([first, second, 3 * SIDE - first - second], axis=1) / (3 * SIDE)
    return weights[np.argsort(-weights.min(axis=1), kind="stable")]


def sample_points(corners: Float64[np.ndarray, "F 3 3"]) -> Float64[np.ndarray, "F S 3"]:
    """POINTS points on each triangle, its centre first."""
    return np.einsum("sc,fcx->fsx", _weights(), corners)
