"""Connected pieces of a mesh."""

import numpy as np
import scipy.sparse as sp
from jaxtyping import Int64
from scipy.sparse.csgraph import connected_components

from meshshard_prep.features.edges import Edges


def components_of(edges: Edges, vertices: int) -> tuple[int, Int64[np.ndarray, " V"]]:
    """Connected pieces of a mesh, how many and which each vertex is in: a shared face, and so an edge, connects."""
    links = (np.ones(len(edges.ends), dtype=np.int8), tuple(edges.ends.T))
    graph = sp.coo_array(links, shape=(vertices, vertices))
    count, member = connected_components(graph, directed=False)
    return int(count), member.astype(np.int64)


def members_of(piece_of: np.ndarray) -> list[np.ndarray]:
    """The vertices of each piece, rising, from the number of each vertex's piece."""
    return np.split(np.argsort(piece_of, kind="stable"), np.cumsum(np.bincount(piece_of))[:-1])
