"""Voting: a face takes the commonest class among the faces that share a vertex with it, or the likeliest by the mean
of their probabilities; a vertex that among the vertices that share a face with it."""

from collections.abc import Iterable, Iterator

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int

from meshshard import Sample
from meshshard_train.config import TrainConfig


def elected(
    labels: Int[np.ndarray, " n"],
    probabilities: Float[np.ndarray, "n K"],
    sample: Sample,
    config: TrainConfig,
    rounds: Iterable[int],
) -> Iterator[Int[np.ndarray, " n"]]:
    """`elections` among the faces or vertices of a mesh, as a run holds them."""
    near = neighbours(sample.faces, len(sample.vertices), config.task, config.votes_itself)
    return elections(labels, probabilities, near, rounds, config.votes)


def elections(
    labels: Int[np.ndarray, " n"],
    probabilities: Float[np.ndarray, "n K"],
    near: sp.csr_array,
    rounds: Iterable[int],
    votes: str,
) -> Iterator[Int[np.ndarray, " n"]]:
    """Labels after each of some rising numbers of rounds. `labels`: the likeliest classes. `near`: (n,n), 1 for each
    that has a vote, one at least. `votes`: "classes", majorities; or "probabilities": each takes the mean of its
    voters', in every round anew, and has the likeliest class after the last."""
    shares = sp.diags_array(1 / near.sum(axis=1)) @ near if votes == "probabilities" else None
    done = 0
    for count in rounds:
        if shares is None:
            labels = vote(labels, near, count - done)
        elif count > done:
            for _ in range(count - done):
                probabilities = shares @ probabilities
            labels = probabilities.argmax(axis=1)
        yield labels
        done = count


def vote(labels: Int[np.ndarray, " n"], near: sp.csr_array, rounds: int) -> Int[np.ndarray, " n"]:
    """Labels after some rounds: all vote at once. Ties to the lowest class. `near`: (n,n), symmetric, 1 for each
    whose class is a vote."""
    if len(labels) == 0:
        return labels
    one_hot = np.eye(int(labels.max()) + 1, dtype=np.float32)
    before = labels
    for left in range(rounds, 0, -1):
        after = (near @ one_hot[labels]).argmax(axis=1)
        if np.array_equal(after, labels):
            return labels
        # majorities end fixed or in turns of two (Goles and Olivos 1980): nothing else is to come
        if np.array_equal(after, before):
            return after if left % 2 else labels
        before, labels = labels, after
    return labels


def neighbours(faces: Int[np.ndarray, "F 3"], vertices: int, task: str, itself: bool = True) -> sp.csr_array:
    """Who votes with whom in a mesh of so many vertices: among faces, or, for vertex_segmentation, among vertices.
    `itself`: each has a vote on itself; one without neighbours always has."""
    ones, starts = np.ones(faces.size, dtype=np.float32), np.arange(0, faces.size + 1, 3)
    corners = sp.csr_array((ones, faces.ravel(), starts), shape=(len(faces), vertices))
    if task == "vertex_segmentation":
        near = sp.csr_array(corners.T @ corners + sp.eye_array(vertices, dtype=np.float32))
    else:
        near = sp.csr_array(corners @ corners.T)
    near.data[:] = 1
    if not itself:
        near.setdiag(np.diff(near.indptr) == 1)
    return near
