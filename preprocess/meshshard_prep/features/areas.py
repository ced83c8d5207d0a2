"""Areas of faces and vertices."""

import numpy as np
from jaxtyping import Float64, Int64

from meshshard_prep.features.normals import face_normals

SLIVER = 1e-6
"""Ratio of an area to that of the equilateral triangle on the longest edge, below which it counts as none."""


def face_areas(vertices: Float64[np.ndarray, "V 3"], faces: Int64[np.ndarray, "F 3"]) -> Float64[np.ndarray, " F"]:
    """Area of each triangle, in squared units of the vertices."""
    return np.linalg.norm(face_normals(vertices, faces), axis=1) / 2


def vertex_areas(vertices: Float64[np.ndarray, "V 3"], faces: Int64[np.ndarray, "F 3"]) -> Float64[np.ndarray, " V"]:
    """Barycentric lumped mass: a third of the area of every face at the vertex. Sums to the surface area."""
    third = np.repeat(face_areas(vertices, faces) / 3, 3)
    return np.bincount(faces.ravel(), third, minlength=len(vertices))


def positive_areas(
    vertices: Float64[np.ndarray, "V 3"], faces: Int64[np.ndarray, "F 3"]
) -> Float64[np.ndarray, " V"]:
    """`vertex_areas`, but at least SLIVER of what equilateral faces with the same longest edges would give.

    So a vertex whose faces all have no area can be divided by, on any scale and beside pieces of any size.
    """
    corners = vertices[faces]
    longest = np.square(corners - np.roll(corners, 1, axis=1)).sum(axis=2).max(axis=1)
    third = np.repeat(SLIVER * np.sqrt(3) / 4 * longest / 3, 3)
    least = np.bincount(faces.ravel(), third, minlength=len(vertices))
    return np.maximum(vertex_areas(vertices, faces), least)
