import numpy as np
import pytest
from shapes import FAMILY, box, grid, rotation

from meshshard_prep.features.adjacency import face_adjacency
from meshshard_prep.features.dihedral import mean_dihedral, official_dihedral, turning_angles
from meshshard_prep.features.edges import edges_of


def mean_of(vertices, faces):
    return mean_dihedral(vertices, faces, edges_of(faces))


@pytest.mark.parametrize(("a", "b", "c"), [(1, 1, 1), (1, 2, 3), (0.1, 10, 5)])
def test_integral_mean_curvature_of_a_box(a, b, c):
    vertices, faces = box(a, b, c)
    edges = edges_of(faces)
    interior, angle = turning_angles(vertices, faces, edges)
    ends = vertices[edges.ends[interior]]
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    assert (angle * length).sum() == pytest.approx(2 * np.pi * (a + b + c), rel=1e-13)


@pytest.mark.parametrize("turn", [0.0, 0.3, np.pi / 2, 3.0, np.pi])
def test_one_hinge(turn):
    """Two triangles at one edge, the second turned about it: flat 0, folded shut pi."""
    vertices = np.array([[0, 0, 0], [0, 1, 0], [-1, 0.5, 0], [np.cos(turn), 0.5, np.sin(turn)]])
    faces = np.array([[0, 1, 2], [1, 0, 3]])
    np.testing.assert_allclose(mean_of(vertices, faces), [turn, turn, 0, 0], atol=1e-12)


def test_flat_sheet_and_border():
    assert not mean_of(*grid(3, 3)).any()
    lone = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], dtype=float)
    assert not mean_of(lone, np.array([[0, 1, 2]])).any()


@pytest.mark.parametrize("name", FAMILY)
def test_invariances(name):
    vertices, faces = FAMILY[name]
    rng = np.random.default_rng(0)
    expected = mean_of(vertices, faces)
    np.testing.assert_allclose(mean_of(7 * vertices @ rotation().T + 3, faces), expected, atol=1e-7)
    wound = np.where(rng.random(len(faces))[:, None] < 0.5, faces, faces[:, ::-1])
    np.testing.assert_allclose(mean_of(vertices, wound[rng.permutation(len(faces))]), expected, atol=1e-12)
    order = rng.permutation(len(vertices))
    np.testing.assert_allclose(mean_of(vertices[order], np.argsort(order)[faces]), expected[order], atol=1e-12)


def test_faces_without_area_say_nothing():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [1, 1, 0]], dtype=float)
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    assert not mean_of(vertices, faces).any()


@pytest.mark.parametrize("name", FAMILY)
def test_official_channels_against_a_plain_loop(name):
    vertices, faces = FAMILY[name]
    adjacency = face_adjacency(edges_of(faces))
    cross = np.cross(vertices[faces[:, 1]] - vertices[faces[:, 0]], vertices[faces[:, 2]] - vertices[faces[:, 0]])
    unit = cross / np.linalg.norm(cross, axis=1, keepdims=True)
    sums, counts = np.zeros((len(vertices), 3)), np.zeros(len(vertices))
    for face, row in enumerate(adjacency):
        value = [np.exp(1 - (abs(unit[face] @ unit[other]) if other >= 0 else 1.0)) for other in row]
        for corner in faces[face]:
            sums[corner] += value
            counts[corner] += 1
    np.testing.assert_allclose(official_dihedral(vertices, faces, adjacency), sums / counts[:, None], rtol=1e-12)
