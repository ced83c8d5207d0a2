"""Labels of edges, faces and vertices, turned into one another. -1 is unlabelled, and is never counted as a label."""

import numpy as np
from jaxtyping import Int, Int64

from meshshard.label_lines import most_common

EDGES_TO_FACES = "face: the label of two of its three edges; else unlabelled"
VERTICES_TO_FACES = "face: the label of two of its three corners; else unlabelled"
FACES_TO_VERTICES = "vertex: the label of most of its labelled faces, the lowest of several; without one unlabelled"


def two_of_three(labels: Int[np.ndarray, "F 3"]) -> Int64[np.ndarray, " F"]:
    """The label of a triangle from those of its three edges, or of its three corners: the one that two of them have.

    -1 where all three differ, or fewer than two are labelled; so there are no ties.
    """
    a, b, c = labels.astype(np.int64).T
    return np.where((a == b) | (a == c), a, np.where(b == c, b, -1))


def faces_to_vertices(
    labels: Int[np.ndarray, " P"], faces: Int[np.ndarray, "F 3"], face_source: Int[np.ndarray, " F"], vertices: int
) -> Int64[np.ndarray, " vertices"]:
    """The label that most of a vertex's polygons have, by `most_common`: each counts once, however many triangles
    were cut from it. `labels` are those of polygons; `face_source` is the polygon of each triangle."""
    around = _distinct(faces.ravel(), np.repeat(face_source, 3), len(labels))
    return most_common(around[0], labels[around[1]], vertices)


def faces_to_edges(
    labels: Int[np.ndarray, " F"], of_face: Int[np.ndarray, "F 3"], edges: int
) -> Int64[np.ndarray, " edges"]:
    """The label that most of an edge's triangles have, by `most_common`: where two differ, the lower one. `of_face`
    and the order of edges are those of `features.edges`."""
    around = _distinct(of_face.ravel(), np.repeat(np.arange(len(labels)), 3), len(labels))
    return most_common(around[0], labels[around[1]], edges)


def _distinct(
    owners: Int[np.ndarray, " N"], faces: Int[np.ndarray, " N"], count: int
) -> tuple[Int64[np.ndarray, " M"], Int64[np.ndarray, " M"]]:
    """Pairs of an owner and a face, each once: a face may have the same corner or edge twice."""
    pairs = np.unique(owners.astype(np.int64) * count + faces)
    return np.divmod(pairs, count)
