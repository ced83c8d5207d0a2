"""The step weld: vertices at the same point become one."""

from dataclasses import replace

import numpy as np

from meshshard_prep.clean import same_point
from meshshard_prep.prepare.traced import Traced


def weld(mesh: Traced) -> tuple[Traced, dict[str, int]]:
    """Merge vertices of faces that lie at exactly the same point into the first of them.

    Vertices that no face uses stay as they are. So does the number of faces: one that gets a repeated corner is
    counted as degenerate, as it would be on the working copy.
    """
    referenced = np.zeros(len(mesh.vertices), dtype=bool)
    referenced[mesh.faces.ravel()] = True
    merged = same_point(mesh.vertices, referenced)
    stays = merged == np.arange(len(merged))
    number = np.cumsum(stays) - 1
    welded = replace(
        mesh,
        vertices=mesh.vertices[stays],
        faces=number[merged[mesh.faces]],
        vertex_source=mesh.vertex_source[stays],
    )
    return welded, {"merged_vertices": int((~stays).sum())}
