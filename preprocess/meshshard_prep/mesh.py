"""A mesh as its file says it, before anything is cleaned."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64, Int64


@dataclass(frozen=True, eq=False, kw_only=True)
class RawMesh:
    """Vertices and triangles in file order.

    `face_source[i]` is the polygon of the file (0-based) that triangle i came from; polygons are cut into fans from
    their first corner, so a triangle file has face_source = 0..F-1. Every polygon gives at least one triangle.
    """

    vertices: Float64[np.ndarray, "V 3"]
    faces: Int64[np.ndarray, "F 3"]
    face_source: Int64[np.ndarray, " F"]
    polygons: int
