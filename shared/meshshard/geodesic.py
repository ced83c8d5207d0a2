"""Lengths of paths on a mesh, from some vertices to all."""

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Float64, Int
from scipy.sparse.csgraph import dijkstra


def distances(
    vertices: Float[np.ndarray, "V 3"], faces: Int[np.ndarray, "F 3"], sources: Int[np.ndarray, " S"]
) -> Float64[np.ndarray, "S V"]:
    """Length of the shortest path from each source to each vertex, along edges and straight across pairs of faces.

    Every path lies on the surface, so no distance is too short; on evenly meshed spheres they are at most 8 % and on
    average 2 % too long. Vertices at the same point are one. Where no path leads, the largest distance found.
    """
    graph, place = surface_graph(vertices, faces)
    wanted, row = np.unique(place[sources], return_inverse=True)
    found = dijkstra(graph, directed=False, indices=wanted)
    reached = np.isfinite(found)
    return np.where(reached, found, found[reached].max())[row.reshape(-1)][:, place]


def surface_graph(
    vertices: Float[np.ndarray, "V 3"], faces: Int[np.ndarray, "F 3"]
) -> tuple[sp.csr_array, Int[np.ndarray, " V"]]:
    """Lengths of the ways that paths are made of, between the P different points of a mesh (P, P), each stored once;
    and the point of each vertex. A path is one of `scipy.sparse.csgraph` with `directed=False`."""
    points, place = np.unique(vertices, axis=0, return_inverse=True)
    place = place.reshape(-1)
    ends, lengths = _edges(points.astype(np.float64), place[faces])
    # of several ways between two points the shortest: entries of a sparse matrix would be added
    order = np.lexsort((lengths, ends[:, 1], ends[:, 0]))
    ends, lengths = ends[order], lengths[order]
    first = np.append(True, (ends[1:] != ends[:-1]).any(axis=1))
    return sp.csr_array((lengths[first], ends[first].T), shape=(len(points), len(points))), place


def _edges(
    points: Float64[np.ndarray, "V 3"], faces: Int[np.ndarray, "F 3"]
) -> tuple[Int[np.ndarray, "n 2"], Float64[np.ndarray, " n"]]:
    """Pairs of vertices (the lower first), and the lengths of straight ways between them: edges, and the ways across
    an edge from one face's corner to the other's."""
    corners = np.concatenate([faces, np.roll(faces, -1, axis=1), np.roll(faces, -2, axis=1)])
    corners = np.hstack([np.sort(corners[:, :2], axis=1), corners[:, 2:]])
    corners = corners[corners[:, 0] < corners[:, 1]]
    low, high, tip = corners[np.lexsort((corners[:, 1], corners[:, 0]))].T
    along = points[high] - points[low]
    length = np.linalg.norm(along, axis=1)
    # each face's corner, unfolded into the plane: how far along the edge, and how far from it
    with np.errstate(divide="ignore", invalid="ignore"):
        far = ((points[tip] - points[low]) * along).sum(axis=1) / length
        away = np.linalg.norm(np.cross(along, points[tip] - points[low]), axis=1) / length
        one = np.flatnonzero((low[1:] == low[:-1]) & (high[1:] == high[:-1]))
        two = one + 1
        crossing = far[one] + (far[two] - far[one]) * away[one] / (away[one] + away[two])
        inside = (crossing >= 0) & (crossing <= length[one]) & (tip[one] != tip[two])
    one, two = one[inside], two[inside]
    across = np.sort(np.stack([tip[one], tip[two]], axis=1), axis=1)
    ends = np.concatenate([np.stack([low, high], axis=1), across])
    return ends, np.concatenate([length, np.hypot(far[one] - far[two], away[one] + away[two])])
