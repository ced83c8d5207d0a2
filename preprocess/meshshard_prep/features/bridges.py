"""Weak links between the pieces of a mesh, so that heat can flow from one to the next."""

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float64, Int64
from scipy.sparse.csgraph import minimum_spanning_tree
from scipy.spatial import Delaunay, KDTree

from meshshard_prep.features.components import members_of
from meshshard_prep.features.edges import Edges, mean_at_ends

MOST = 1e6
"""Largest weight of a link: where pieces touch they are as good as joined."""

AROUND = 10.0 * np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
"""Corners of a tetrahedron around a mesh of size 1: then points in one plane have Delaunay tetrahedra too."""


def bridges(
    vertices: Float64[np.ndarray, "V 3"], edges: Edges, piece_of: Int64[np.ndarray, " V"]
) -> tuple[Int64[np.ndarray, "B 2"], Float64[np.ndarray, " B"]]:
    """The links that join the pieces into one, shortest first: pairs of vertices, and their weights.

    Links run between the nearest vertices of two pieces, along the minimum spanning tree of the gaps between pieces.
    A link over a gap d between vertices with mean edge length l has the weight l / d, a pure number like the
    cotangent weights: it conducts as a strip of the surface would that is l wide and d long. So far pieces are
    joined weakly, pieces that touch as if by a common vertex, and nothing depends on the unit.
    """
    pieces = _neighbouring_pieces(vertices, piece_of)
    rank = sp.coo_array((np.arange(1, len(pieces) + 1), tuple(pieces.T)), shape=(piece_of.max() + 1,) * 2)
    kept = np.sort(minimum_spanning_tree(rank.tocsr()).data.astype(np.int64)) - 1
    pairs, gaps = _nearest(vertices, piece_of, pieces[kept])
    lengths = np.linalg.norm(vertices[edges.ends[:, 0]] - vertices[edges.ends[:, 1]], axis=1)
    width = mean_at_ends(edges.ends, lengths, len(vertices))[pairs].mean(axis=1)
    return pairs, width / np.maximum(gaps, width / MOST)


def _neighbouring_pieces(
    vertices: Float64[np.ndarray, "V 3"], piece_of: Int64[np.ndarray, " V"]
) -> Int64[np.ndarray, "G 2"]:
    """Numbers of pieces that are neighbours, the smaller first, by rising gap between them.

    The shortest link between any two sets of points is an edge of the Delaunay tetrahedra, so those are enough.
    """
    tetrahedra = Delaunay(np.vstack([vertices, np.abs(vertices).max() * AROUND]))
    sides = [tetrahedra.simplices[:, [i, j]] for i in range(4) for j in range(i)]
    pairs = np.concatenate([*sides, tetrahedra.coplanar[:, [0, 2]]]).astype(np.int64)  # coplanar: points met twice
    pairs = pairs[(pairs < len(vertices)).all(axis=1)]
    pairs = pairs[piece_of[pairs[:, 0]] != piece_of[pairs[:, 1]]]
    swap = piece_of[pairs[:, 0]] > piece_of[pairs[:, 1]]
    pairs[swap] = pairs[swap][:, ::-1]
    gaps = np.linalg.norm(vertices[pairs[:, 0]] - vertices[pairs[:, 1]], axis=1)
    order = np.lexsort((pairs[:, 1], pairs[:, 0], gaps))
    pieces = piece_of[pairs[order]]
    _, first = np.unique(pieces, axis=0, return_index=True)
    return pieces[np.sort(first)]


def _nearest(
    vertices: Float64[np.ndarray, "V 3"], piece_of: Int64[np.ndarray, " V"], pieces: Int64[np.ndarray, "B 2"]
) -> tuple[Int64[np.ndarray, "B 2"], Float64[np.ndarray, " B"]]:
    """Nearest vertices of each pair of pieces, and their gap: tetrahedra do not resolve millionths of a mesh."""
    members = members_of(piece_of)
    trees: dict[int, KDTree] = {}
    nearest, gaps = np.empty_like(pieces), np.empty(len(pieces))
    for row, pair in enumerate(pieces):
        small, large = sorted(pair, key=lambda piece: len(members[piece]))
        if large not in trees:
            trees[large] = KDTree(vertices[members[large]])
        found = trees[large].query(vertices[members[small]])
        distance, other = np.asarray(found[0]), np.asarray(found[1])
        best = int(np.argmin(distance))
        nearest[row] = members[small][best], members[large][other[best]]
        gaps[row] = distance[best]
    return nearest, gaps


def bridged(
    stiffness: sp.csc_matrix, vertices: Float64[np.ndarray, "V 3"], edges: Edges, piece_of: Int64[np.ndarray, " V"]
) -> tuple[sp.csc_matrix, int]:
    """The Laplacian of a mesh in pieces with the links that join them, and how many those are."""
    pairs, weights = bridges(vertices, edges, piece_of)
    return add_links(stiffness, pairs, weights), len(pairs)


def add_links(
    stiffness: sp.csc_matrix, pairs: Int64[np.ndarray, "B 2"], weights: Float64[np.ndarray, " B"]
) -> sp.csc_matrix:
    """The Laplacian with further edges of these weights."""
    a, b = pairs.T
    rows, columns = np.concatenate([a, b, a, b]), np.concatenate([a, b, b, a])
    values = np.concatenate([weights, weights, -weights, -weights])
    return sp.csc_matrix(stiffness + sp.coo_array((values, (rows, columns)), shape=stiffness.shape))
