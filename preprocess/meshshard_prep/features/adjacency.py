"""The neighbours of a face."""

import numpy as np
from jaxtyping import Int64

from meshshard_prep.features.edges import Edges


def face_adjacency(edges: Edges) -> Int64[np.ndarray, "F 3"]:
    """Face across the edges (0,1), (1,2), (2,0) of each face; -1 where not exactly two faces share the edge."""
    _, halves = edges.pairs
    neighbour = np.full(edges.of_face.size, -1)
    neighbour[halves[:, 0]] = halves[:, 1] // 3
    neighbour[halves[:, 1]] = halves[:, 0] // 3
    return neighbour.reshape(-1, 3)
