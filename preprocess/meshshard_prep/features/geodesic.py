"""How far a vertex is from the rest of its piece, along the surface, and how much surface is near it."""

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float64, Int64
from scipy.sparse.csgraph import connected_components, dijkstra

from meshshard.geodesic import surface_graph
from meshshard_prep.features.components import members_of

LANDMARKS = 1000
"""Points of a piece that stand for all of a larger one."""

RADII = (0.05, 0.08, 0.12, 0.18, 0.25, 0.35, 0.5, 0.7)
"""Of geodesic discs, in square roots of the mesh's area."""

SOFTNESS = 0.15
"""Width of a disc's edge, in radii: without it, a coarse mesh would give steps."""


def geodesic_features(
    vertices: Float64[np.ndarray, "V 3"], faces: Int64[np.ndarray, "F 3"], areas: Float64[np.ndarray, " V"]
) -> Float64[np.ndarray, "V 10"]:
    """For each vertex the mean and the largest geodesic distance to its piece, in square roots of the mesh's area;
    then of its geodesic discs with the radii RADII the area, over that of a flat disc.

    All are above 0 and do not depend on position, size or numbering (where several points are equally far, landmarks
    may be others). A flat mesh far from its border has ratios of 1, a thin limb small ones. Paths as in
    `meshshard.geodesic`; of a larger piece LANDMARKS, each the farthest from those before, stand for all vertices.
    `areas`: of vertices, with a positive sum. Sources: Hilaga et al. 2001 (mean distance), Sun, Chen and Funkhouser
    2008 (discs).
    """
    graph, place = surface_graph(vertices, faces)
    shares = np.bincount(place, areas, minlength=graph.shape[0]) / areas.sum()
    points = np.zeros((graph.shape[0], 3))
    points[place] = vertices
    found = np.empty((graph.shape[0], 2 + len(RADII)))
    for piece in members_of(connected_components(graph, directed=False)[1]):
        found[piece] = _of_piece(graph[piece][:, piece], points[piece], shares[piece], float(np.sqrt(areas.sum())))
    return found[place]


def _of_piece(
    graph: sp.csr_array, points: Float64[np.ndarray, "P 3"], shares: Float64[np.ndarray, " P"], unit: float
) -> Float64[np.ndarray, "P 10"]:
    """The rows of one piece. `shares`: of the mesh's area, at each point."""
    away = landmark_distances(graph, points) / unit
    cells = np.bincount(away.argmin(axis=0), shares, minlength=len(away))
    discs = [cells @ _inside(away, radius) / (np.pi * radius**2) for radius in RADII]
    # a point alone, and one on nothing but flat faces, is near itself
    mean = np.maximum(cells @ away / max(cells.sum(), np.finfo(float).tiny), np.finfo(np.float32).tiny)
    return np.stack([mean, np.maximum(away.max(axis=0), mean), *np.maximum(discs, np.finfo(np.float32).tiny)], axis=1)


def _inside(away: Float64[np.ndarray, "L P"], radius: float) -> Float64[np.ndarray, "L P"]:
    """1 well within a disc, 1/2 on its edge, 0 well beyond."""
    return 1 / (1 + np.exp(np.minimum((away / radius - 1) / SOFTNESS, 700)))


def landmark_distances(graph: sp.csr_array, points: Float64[np.ndarray, "P 3"]) -> Float64[np.ndarray, "L P"]:
    """Distances from landmarks of one piece to all its points. Landmarks are all points, or LANDMARKS of them: the
    one farthest from the middle, then again and again the one that is farthest from all landmarks so far."""
    if len(points) <= LANDMARKS:
        return dijkstra(graph, directed=False)
    farthest = int(np.linalg.norm(points - points.mean(axis=0), axis=1).argmax())
    rows: list[Float64[np.ndarray, " P"]] = []
    nearest = np.full(len(points), np.inf)
    for _ in range(LANDMARKS):
        rows.append(dijkstra(graph, directed=False, indices=[farthest])[0])
        nearest = np.minimum(nearest, rows[-1])
        farthest = int(nearest.argmax())
    return np.stack(rows)
