from collections import Counter

import numpy as np
import pytest
from shapes import FAMILY, write_obj

from meshshard_train.bench.peer import CLASSES, vote_around_vertices
from meshshard_train.voting import elections, neighbours, vote


def together(faces, vertices, task):
    """For each face, or vertex, the numbers of those it votes with, itself among them; by plain loops."""
    sets = [set(face) for face in faces.tolist()]
    if task == "segmentation":
        return [[i for i, other in enumerate(sets) if other & face] for face in sets]
    return [sorted(set().union({vertex}, *(face for face in sets if vertex in face))) for vertex in range(vertices)]


def one_round(labels, near):
    result = []
    for members in near:
        votes = Counter(int(labels[i]) for i in members)
        result.append(min(votes, key=lambda label: (-votes[label], label)))
    return np.array(result)


TASKS = ["segmentation", "vertex_segmentation"]


@pytest.mark.parametrize("task", TASKS)
@pytest.mark.parametrize("name", FAMILY)
def test_against_a_plain_loop(name, task):
    vertices, faces = FAMILY[name]
    near = neighbours(faces, len(vertices), task)
    labels = np.random.default_rng(0).integers(0, 4, near.shape[0])
    plain = together(faces, len(vertices), task)
    expected = labels
    for rounds in range(4):
        np.testing.assert_array_equal(vote(labels, near, rounds), expected)
        expected = one_round(expected, plain)


@pytest.mark.parametrize("task", TASKS)
@pytest.mark.parametrize("name", FAMILY)
def test_elections_against_a_plain_loop(name, task):
    """Of classes and of probabilities, also where some numbers of rounds are asked for at once."""
    vertices, faces = FAMILY[name]
    near, plain = neighbours(faces, len(vertices), task), together(faces, len(vertices), task)
    rows = np.random.default_rng(0).dirichlet(np.ones(4), near.shape[0])
    labels, means, counts = rows.argmax(axis=1), [rows], [0, 1, 3]
    for _ in range(3):
        means.append(np.array([means[-1][members].mean(axis=0) for members in plain]))
    for votes, expected in {
        "classes": [vote(labels, near, count) for count in counts],
        "probabilities": [means[count].argmax(axis=1) for count in counts],
    }.items():
        at_once = list(elections(labels, rows, near, counts, votes))
        np.testing.assert_array_equal(at_once, expected)
        for count, result in zip(counts, expected, strict=True):
            np.testing.assert_array_equal(list(elections(labels, rows, near, [count], votes)), [result])


def test_one_that_is_sure_is_heard_by_probabilities_alone():
    """Three faces around a vertex: two are hardly for class 0, the third is sure of class 1."""
    near = neighbours(np.array([[0, 1, 2], [0, 3, 4], [0, 5, 6]]), 7, "segmentation")
    rows = np.array([[0.55, 0.45], [0.55, 0.45], [0.0, 1.0]])
    labels = rows.argmax(axis=1)
    assert [one.tolist() for one in elections(labels, rows, near, [1], "classes")] == [[0, 0, 0]]
    assert [one.tolist() for one in elections(labels, rows, near, [1], "probabilities")] == [[1, 1, 1]]


def test_without_voters_there_is_nothing_to_elect():
    nothing = neighbours(np.zeros((0, 3), dtype=int), 0, "segmentation")
    for votes in ("classes", "probabilities"):
        (found,) = elections(np.zeros(0, dtype=int), np.zeros((0, 3)), nothing, [2], votes)
        assert found.tolist() == []


def test_labels_that_return_every_second_round_are_those_of_round_after_round():
    vertices, faces = FAMILY["pieces"]
    near, returned = neighbours(faces, len(vertices), "segmentation"), 0
    for seed in range(60):
        labels = np.random.default_rng(seed).integers(0, 3, len(faces))
        single = labels
        for rounds in range(16):
            np.testing.assert_array_equal(vote(labels, near, rounds), single)
            single = vote(single, near, 1)
        returned += not np.array_equal(single, vote(single, near, 1))
    assert returned > 0


@pytest.mark.parametrize("task", TASKS)
def test_the_order_of_faces_and_vertices_does_not_matter(task):
    vertices, faces = FAMILY["torus"]
    rng = np.random.default_rng(1)
    order, new = rng.permutation(len(faces)), rng.permutation(len(vertices))
    near = neighbours(faces, len(vertices), task)
    other = neighbours(new[faces][order], len(vertices), task)
    labels = rng.integers(0, 3, near.shape[0])
    places = order if task == "segmentation" else np.argsort(new)
    np.testing.assert_array_equal(vote(labels[places], other, 3), vote(labels, near, 3)[places])


def test_agreement_stays_and_a_lonely_face_gives_in():
    vertices, faces = FAMILY["sphere"]
    near = neighbours(faces, len(vertices), "segmentation")
    labels = np.full(len(faces), 2)
    np.testing.assert_array_equal(vote(labels, near, 5), labels)
    labels[7] = 0
    assert (vote(labels, near, 1) == 2).all()


def test_degenerate_and_lone_faces_and_vertices():
    faces = np.array([[0, 0, 1], [5, 6, 7]])
    near = neighbours(faces, 8, "segmentation")
    assert near.toarray().tolist() == [[1, 0], [0, 1]]
    assert vote(np.array([3, 1]), near, 2).tolist() == [3, 1]
    near = neighbours(faces, 8, "vertex_segmentation")
    assert vote(np.array([2, 1, 3, 4, 5, 1, 1, 0]), near, 2).tolist() == [1, 1, 3, 4, 5, 1, 1, 1]
    nothing = neighbours(np.zeros((0, 3), dtype=int), 0, "segmentation")
    assert vote(np.zeros(0, dtype=int), nothing, 2).tolist() == []


@pytest.mark.parametrize("name", FAMILY)
def test_without_a_vote_of_its_own_it_is_the_published_vote(tmp_path, name):
    """Of a face that has neighbours; one that has none keeps its class."""
    vertices, faces = FAMILY[name]
    write_obj(tmp_path / "a.obj", vertices, faces)
    labels = np.random.default_rng(1).integers(0, len(CLASSES), len(faces))
    near = neighbours(faces, len(vertices), "segmentation", itself=False)
    lonely = np.array([len(voters) == 1 for voters in together(faces, len(vertices), "segmentation")])
    expected = np.where(lonely, labels, vote_around_vertices(tmp_path / "a.obj", labels))
    np.testing.assert_array_equal(vote(labels, near, 1), expected)


def test_a_lonely_face_without_a_vote_keeps_its_class():
    near = neighbours(np.array([[0, 1, 2], [3, 4, 5], [5, 6, 7]]), 8, "segmentation", itself=False)
    assert vote(np.array([2, 1, 3]), near, 1).tolist() == [2, 3, 1]
