from collections import Counter

import numpy as np
import pytest
from shapes import FAMILY

from meshshard_train.voting import vertex_neighbours, vote


def one_round(labels, faces):
    """Every face asks all faces that share a vertex with it, itself once; ties to the lowest class."""
    result = []
    for face in faces.tolist():
        votes = Counter(int(labels[i]) for i, other in enumerate(faces.tolist()) if set(face) & set(other))
        result.append(min(votes, key=lambda label: (-votes[label], label)))
    return np.array(result)


@pytest.mark.parametrize("name", FAMILY)
def test_against_a_plain_loop(name):
    _, faces = FAMILY[name]
    labels = np.random.default_rng(0).integers(0, 4, len(faces))
    expected = labels
    for rounds in range(4):
        np.testing.assert_array_equal(vote(labels, faces, rounds), expected)
        expected = one_round(expected, faces)


def test_agreement_stays_and_a_lonely_face_gives_in():
    _, faces = FAMILY["sphere"]
    labels = np.full(len(faces), 2)
    np.testing.assert_array_equal(vote(labels, faces, 5), labels)
    labels[7] = 0
    assert (vote(labels, faces, 1) == 2).all()


def test_degenerate_and_lone_faces():
    faces = np.array([[0, 0, 1], [5, 6, 7]])
    assert vote(np.array([3, 1]), faces, 2).tolist() == [3, 1]
    assert vertex_neighbours(faces).toarray().tolist() == [[1, 0], [0, 1]]
    assert vote(np.zeros(0, dtype=int), np.zeros((0, 3), dtype=int), 2).tolist() == []
