"""Majority voting: a face takes the commonest class among the faces that share a vertex with it."""

import numpy as np
import scipy.sparse as sp
from jaxtyping import Int


def vote(labels: Int[np.ndarray, " F"], faces: Int[np.ndarray, "F 3"], rounds: int) -> Int[np.ndarray, " F"]:
    """Labels after some rounds; each face counts itself once and every neighbour once. Ties to the lowest class."""
    if rounds == 0 or len(labels) == 0:
        return labels
    near = vertex_neighbours(faces)
    classes = np.arange(int(labels.max()) + 1)
    for _ in range(rounds):
        labels = (near @ (labels[:, None] == classes).astype(np.float32)).argmax(axis=1)
    return labels


def vertex_neighbours(faces: Int[np.ndarray, "F 3"]) -> sp.csr_array:
    """(F,F), 1 where two faces share a vertex, and on the diagonal."""
    count = len(faces)
    corners = sp.csr_array(
        (np.ones(3 * count, dtype=np.float32), faces.ravel(), np.arange(0, 3 * count + 1, 3)),
        shape=(count, int(faces.max()) + 1),
    )
    near = sp.csr_array(corners @ corners.T)
    near.data[:] = 1
    return near
