import numpy as np
import pytest
from shapes import sphere

from meshshard_prep.minicoseg.defects import add_fin, cut_open


@pytest.fixture
def ball():
    vertices, faces = sphere(3)
    labels = (vertices[faces].mean(axis=1)[:, 1] > 0.3).astype(np.int64)
    surface = vertices, faces.astype(np.int64), labels
    for array in surface:
        array.flags.writeable = False
    return surface


@pytest.mark.parametrize("seed", range(12))
def test_cut_open(look, ball, seed):
    vertices, faces, labels = cut_open(ball, np.random.default_rng(seed))
    seen = look(vertices, faces)
    assert set(seen.uses) == {1, 2}
    assert seen.oriented
    assert (seen.components, seen.pinched) == (1, 0)
    assert seen.euler == 1  # a disc: one hole
    assert 0.5 * len(ball[1]) < len(faces) == len(labels) < len(ball[1])
    assert np.unique(faces).tolist() == list(range(len(vertices)))


def ring(faces, vertex):
    return set(faces[(faces == vertex).any(axis=1)].ravel()) - {vertex}


def test_two_holes_that_would_touch_in_one_vertex_become_one(look, ball):
    vertices, faces, labels = ball
    opposite = next(v for v in range(len(vertices)) if v != 0 and len(ring(faces, 0) & ring(faces, v)) == 1)
    footed = vertices.copy()
    footed[[0, opposite], 1] = -5  # the only two that lie at the cut
    without_underside = next(seed for seed in range(99) if np.random.default_rng(seed).integers(3) == 0)
    opened = cut_open((footed, faces, labels), np.random.default_rng(without_underside))
    seen = look(*opened[:2])
    assert len(opened[0]) == len(vertices) - 3  # the vertex between them went too
    assert (seen.pinched, seen.euler) == (0, 1)


def test_cut_open_leaves_the_labels_on_their_faces(ball):
    vertices, faces, labels = cut_open(ball, np.random.default_rng(1))
    np.testing.assert_array_equal(labels, vertices[faces].mean(axis=1)[:, 1] > 0.3)


@pytest.mark.parametrize("seed", range(6))
def test_a_fin_stands_on_edges_that_have_two_faces_already(look, ball, seed):
    vertices, faces, labels = add_fin(ball, np.random.default_rng(seed))
    seen = look(vertices, faces)
    fin = len(faces) - len(ball[1])
    assert np.count_nonzero(seen.uses == 3) == fin / 2 >= 4
    assert seen.uses.max() == 3
    assert seen.components == 1
    assert len(labels) == len(faces)
    np.testing.assert_array_equal(faces[:-fin], ball[1])
    assert np.linalg.norm(vertices[len(ball[0]) :], axis=1) == pytest.approx(1.08, abs=0.03)


def test_a_fin_has_the_class_of_what_it_stands_on(ball):
    _, faces, labels = add_fin(ball, np.random.default_rng(4))
    for face, label in zip(faces[len(ball[1]) :], labels[len(ball[1]) :], strict=True):
        feet = face[face < len(ball[0])]
        touching = np.isin(ball[1], feet).any(axis=1)
        assert label in ball[2][touching]
