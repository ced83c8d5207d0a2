import numpy as np
import pytest
from shapes import FAMILY, box, grid, rotation

from meshshard_prep.features.adjacency import face_adjacency
from meshshard_prep.features.dihedral import mean_dihedral, mean_signed_dihedral, official_dihedral, turning_angles
from meshshard_prep.features.edges import edges_of


def mean_of(vertices, faces):
    return mean_dihedral(vertices, faces, edges_of(faces))


@pytest.mark.parametrize(("a", "b", "c"), [(1, 1, 1), (1, 2, 3), (0.1, 10, 5)])
def test_integral_mean_curvature_of_a_box(a, b, c):
    vertices, faces = box(a, b, c)
    edges = edges_of(faces)
    interior, angle, _ = turning_angles(vertices, faces, edges)
    ends = vertices[edges.ends[interior]]
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    assert (angle * length).sum() == pytest.approx(2 * np.pi * (a + b + c), rel=1e-13)


@pytest.mark.parametrize("turn", [0.0, 0.3, np.pi / 2, 3.0, np.pi])
def test_one_hinge(turn):
    """Two triangles at one edge, the second turned about it: flat 0, folded shut pi."""
    vertices = np.array([[0, 0, 0], [0, 1, 0], [-1, 0.5, 0], [np.cos(turn), 0.5, np.sin(turn)]])
    faces = np.array([[0, 1, 2], [1, 0, 3]])
    np.testing.assert_allclose(mean_of(vertices, faces), [turn, turn, 0, 0], atol=1e-12)
    signed = mean_signed_dihedral(vertices, faces, edges_of(faces))
    up = [-turn, -turn, 0, 0]  # normals point up, and the second triangle rises towards them: concave
    np.testing.assert_allclose(
        signed if turn < np.pi else np.abs(signed), up if turn < np.pi else np.abs(up), atol=1e-12
    )


def test_signed_is_positive_at_convex_and_negative_at_concave_edges():
    vertices, faces = box(1, 2, 3)
    edges = edges_of(faces)
    outward, inward = (mean_signed_dihedral(vertices, f, edges_of(f)) for f in (faces, faces[:, ::-1]))
    np.testing.assert_allclose(outward, mean_dihedral(vertices, faces, edges))
    np.testing.assert_allclose(inward, -outward)
    rotated = mean_signed_dihedral(5 * vertices @ rotation(2), faces, edges)
    np.testing.assert_allclose(rotated, outward, atol=1e-12)


def test_signed_leaves_out_edges_without_an_outside():
    """A strip of three triangles, the last wound as the others or against them."""
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 1], [0, 2, 3]], dtype=float)
    alike, against = (np.array([[0, 1, 2], [1, 3, 2], last]) for last in ([2, 3, 4], [2, 4, 3]))
    without = alike[:2]
    signed = [mean_signed_dihedral(vertices, faces, edges_of(faces)) for faces in (alike, against, without)]
    np.testing.assert_array_equal(signed[1], signed[2])
    assert np.abs(signed[0][[2, 3]] - signed[2][[2, 3]]).min() > 0.01


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
