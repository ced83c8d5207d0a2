"""What the shape of a triangle mesh is like: pieces, borders, orientation, genus, sizes. Counted, never repaired."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from jaxtyping import Bool, Float64, Int64
from scipy.sparse.csgraph import connected_components

from meshshard_prep.features.components import components_of
from meshshard_prep.features.edges import Edges


@dataclass(frozen=True, kw_only=True)
class Facts:
    """Beyond what every sample counts (`pipeline.counts_of`).

    `piece_faces`: faces of each connected piece, most first. `closed_pieces`: those whose every edge has two faces.
    `boundary_loops`: connected chains of edges with one face. `bowtie_vertices`: vertices whose faces form more than
    one fan. `duplicate_faces`: faces with the corners of an earlier one, in any order. `disagreeing_edges`: edges
    whose two faces run through them in the same direction. `orientable`: turning faces over could make them agree.
    `inside_out_pieces`: closed, oriented pieces of negative volume. `euler_characteristic`: V - E + F. `genus`: of
    all pieces together; None where a surface has none: not orientable, or non-manifold somewhere.
    `edge_ratio`: longest over shortest edge. `float32_collisions`: vertices that float32 puts on another one.
    """

    piece_faces: tuple[int, ...]
    closed_pieces: int
    boundary_loops: int
    bowtie_vertices: int
    duplicate_faces: int
    disagreeing_edges: int
    orientable: bool
    inside_out_pieces: int
    euler_characteristic: int
    genus: int | None
    edge_ratio: float
    float32_collisions: int


def facts_of(vertices: Float64[np.ndarray, "V 3"], faces: Int64[np.ndarray, "F 3"], edges: Edges) -> Facts:
    """The facts of a mesh as `clean` gives it: every vertex in a face, three different corners a face, radius 1."""
    pieces, piece_of = components_of(edges, len(vertices))
    piece_of_face, piece_of_edge = piece_of[faces[:, 0]], piece_of[edges.ends[:, 0]]
    at_odds = disagreeing(faces, edges)
    interior, _ = edges.pairs
    closed = _without(edges.count != 2, piece_of_edge, pieces)
    oriented = _without(at_odds, piece_of_edge[interior], pieces)
    volume = np.bincount(piece_of_face, np.linalg.det(vertices[faces]) / 6, minlength=pieces)
    loops = _loops(edges, len(vertices))
    bowties = _bowties(faces, edges, len(vertices))
    orientable = _orientable(len(faces), edges, at_odds)
    characteristic = len(vertices) - len(edges.ends) + len(faces)
    is_surface = orientable and bowties == 0 and bool((edges.count <= 2).all())
    lengths = np.linalg.norm(vertices[edges.ends[:, 0]] - vertices[edges.ends[:, 1]], axis=1)
    shortest = float(lengths.min())
    return Facts(
        piece_faces=tuple(sorted(np.bincount(piece_of_face).tolist(), reverse=True)),
        closed_pieces=int(closed.sum()),
        boundary_loops=loops,
        bowtie_vertices=bowties,
        duplicate_faces=len(faces) - len(np.unique(np.sort(faces, axis=1), axis=0)),
        disagreeing_edges=int(at_odds.sum()),
        orientable=orientable,
        inside_out_pieces=int((closed & oriented & (volume < 0)).sum()),
        euler_characteristic=characteristic,
        genus=(2 * pieces - loops - characteristic) // 2 if is_surface else None,
        edge_ratio=float(lengths.max()) / shortest if shortest > 0 else float("inf"),
        float32_collisions=len(vertices) - len(np.unique(vertices.astype(np.float32), axis=0)),
    )


def _without(fault: Bool[np.ndarray, " E"], piece_of: Int64[np.ndarray, " E"], pieces: int) -> Bool[np.ndarray, " C"]:
    """Pieces none of whose edges has the fault."""
    return np.bincount(piece_of[fault], minlength=pieces) == 0


def disagreeing(faces: Int64[np.ndarray, "F 3"], edges: Edges) -> Bool[np.ndarray, " P"]:
    """Whether the two faces of each interior edge leave it by the same vertex; on an oriented surface they do not."""
    _, halves = edges.pairs
    tails = faces.ravel()[halves]
    return tails[:, 0] == tails[:, 1]


def _orientable(faces: int, edges: Edges, at_odds: Bool[np.ndarray, " P"]) -> bool:
    """No face is connected with its own other side, in the graph of both sides of all faces."""
    _, halves = edges.pairs
    first, second = halves.T // 3
    crossing = faces * at_odds  # from the upper side of one face to the lower side of the other
    ends = np.concatenate([first, first + faces]), np.concatenate([second + crossing, second + faces - crossing])
    side = _piece_of(ends, 2 * faces)
    return bool((side[:faces] != side[faces:]).all())


def _loops(edges: Edges, vertices: int) -> int:
    border = edges.ends[edges.count == 1]
    piece = _piece_of((border[:, 0], border[:, 1]), vertices)
    return len(np.unique(piece[border[:, 0]]))


def _bowties(faces: Int64[np.ndarray, "F 3"], edges: Edges, vertices: int) -> int:
    """Vertices whose corners are not all connected across edges that end there."""
    sides = np.argsort(edges.of_face.ravel(), kind="stable")
    neighbours = np.stack([sides[:-1], sides[1:]])[:, np.diff(edges.of_face.ravel()[sides]) == 0]
    corner, after = np.arange(faces.size), np.roll(np.arange(faces.size).reshape(-1, 3), -1, axis=1).ravel()
    forward = faces.ravel()[corner] < faces.ravel()[after]
    low, high = np.where(forward, corner, after), np.where(forward, after, corner)
    fan = _piece_of((np.concatenate([low[neighbours[0]], high[neighbours[0]]]),
                     np.concatenate([low[neighbours[1]], high[neighbours[1]]])), faces.size)  # fmt: skip
    fans = np.unique(np.stack([faces.ravel(), fan]), axis=1)[0]
    return int((np.bincount(fans, minlength=vertices) > 1).sum())


def _piece_of(ends: tuple[np.ndarray, np.ndarray], nodes: int) -> Int64[np.ndarray, " N"]:
    graph = sp.coo_array((np.ones(len(ends[0]), dtype=np.int8), ends), shape=(nodes, nodes))
    return connected_components(graph, directed=False)[1].astype(np.int64)
