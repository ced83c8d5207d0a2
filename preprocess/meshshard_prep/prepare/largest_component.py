"""The step largest_component: the piece with the most surface, alone."""

import numpy as np

from meshshard_prep.features.areas import face_areas
from meshshard_prep.features.components import components_of
from meshshard_prep.features.edges import edges_of
from meshshard_prep.prepare.traced import Traced

EQUAL = 1e-9
"""Areas are equal that differ by less, relative to the larger: more than rounding, less than any intent."""


def largest_component(mesh: Traced) -> tuple[Traced, dict[str, int]]:
    """Keep the faces of the piece with the largest area; of equal ones, that of the lowest face.

    Faces that share a point are one piece, whether or not they share a vertex of the file. Faces with a repeated
    corner connect nothing. Vertices go that only dropped faces used; those that no face used stay.
    """
    working = mesh.working()
    pieces, piece_of = components_of(edges_of(working.faces), len(working.vertices))
    piece_of_face = piece_of[working.faces[:, 0]]
    areas = np.bincount(piece_of_face, face_areas(working.vertices, working.faces), minlength=pieces)
    largest = piece_of_face[np.argmax(areas[piece_of_face] >= (1 - EQUAL) * areas.max())]
    in_largest = np.append(piece_of == largest, False)[working.vertex_map]
    kept = in_largest[mesh.faces].all(axis=1)
    return mesh.with_faces(kept), {"dropped_faces": int((~kept).sum())}
