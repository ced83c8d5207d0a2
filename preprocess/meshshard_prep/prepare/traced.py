"""A mesh on its way through the steps, with the maps back to the file."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64, Int64

from meshshard_prep.clean import Mesh, clean
from meshshard_prep.mesh import RawMesh


@dataclass(frozen=True, eq=False, kw_only=True)
class Traced:
    """V vertices, F triangles, in the unit and place of the file.

    `vertex_source` (V,): vertex of the file that each is, or lies nearest to.
    `triangle_sources` (F,S): triangle of the file at each of S points of a triangle, which stand for equal shares of
    its area; the first is its centre. S is 1 until simplify moves vertices.
    """

    vertices: Float64[np.ndarray, "V 3"]
    faces: Int64[np.ndarray, "F 3"]
    vertex_source: Int64[np.ndarray, " V"]
    triangle_sources: Int64[np.ndarray, "F S"]
    place: str

    def working(self) -> Mesh:
        """Its working copy, always welded: what is one piece, closed, or smooth does not depend on seams."""
        return clean(self.vertices, self.faces, weld=True, place=self.place)

    def with_faces(self, kept: Bool[np.ndarray, " F"]) -> "Traced":
        """These faces alone; the vertices go that only the others used."""
        stays = np.ones(len(self.vertices), dtype=bool)
        stays[self.faces[~kept]] = False
        stays[self.faces[kept]] = True
        number = np.cumsum(stays) - 1
        return Traced(
            vertices=self.vertices[stays],
            faces=number[self.faces[kept]],
            vertex_source=self.vertex_source[stays],
            triangle_sources=self.triangle_sources[kept],
            place=self.place,
        )


def traced(raw: RawMesh, place: str) -> Traced:
    """The mesh of the file itself. InvalidMesh: it breaks a rule of `clean`."""
    mesh = Traced(
        vertices=raw.vertices,
        faces=raw.faces,
        vertex_source=np.arange(len(raw.vertices)),
        triangle_sources=np.arange(len(raw.faces))[:, None],
        place=place,
    )
    mesh.working()
    return mesh
