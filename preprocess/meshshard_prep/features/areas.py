"""Areas of faces and vertices."""

import numpy as np
from jaxtyping import Float64, Int64

from meshshard_prep.features.normals import face_normals


def face_areas(vertices: Float64[np.ndarray, "V 3"], faces: Int64[np.ndarray, "F 3"]) -> Float64[np.ndarray, " F"]:
    """Area of each triangle, in squared units of the vertices."""
    return np.linalg.norm(face_normals(vertices, faces), axis=1) / 2


def vertex_areas(vertices: Float64[np.ndarray, "V 3"], faces: Int64[np.ndarray, "F 3"]) -> Float64[np.ndarray, " V"]:
    """Barycentric lumped mass: a third of the area of every face at the vertex. Sums to the surface area."""
    third = np.repeat(face_areas(vertices, faces) / 3, 3)
    return np.bincount(faces.ravel(), third, minlength=len(vertices))
