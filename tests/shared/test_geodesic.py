import numpy as np
import pytest
from scipy.sparse.csgraph import floyd_warshall
from shapes import FAMILY, box, bumpy, fin, grid, joined, rotation, sphere

from meshshard.geodesic import distances


@pytest.mark.parametrize("level", [3, 4])
def test_on_a_sphere_they_are_at_most_8_and_on_average_2_per_cent_too_long(level):
    vertices, faces = sphere(level)
    sources = np.arange(0, len(vertices), 7)
    found = distances(vertices, faces, sources)
    true = np.arccos(np.clip(vertices[sources] @ vertices.T, -1, 1))
    far = true > 1e-6
    ratio = found[far] / true[far]
    longest = np.linalg.norm(vertices[faces[:, 0]] - vertices[faces[:, 1]], axis=1).max()
    inside = 1 - longest**2 / 6  # the mesh lies in the sphere: a straight way of 2 edges is this much shorter
    assert inside < ratio.min() < ratio.max() < 1.08
    assert 1 < ratio.mean() < 1.02
    assert not found[~far].any()


def test_paths_along_edges_alone_are_worse():
    """The ways across faces are what brings them down: an independent road, all pairs along edges."""
    vertices, faces = sphere(3)
    lengths = np.full((len(vertices),) * 2, np.inf)
    for a, b in ((0, 1), (1, 2), (2, 0)):
        ends = faces[:, a], faces[:, b]
        lengths[ends] = lengths[ends[::-1]] = np.linalg.norm(vertices[ends[0]] - vertices[ends[1]], axis=1)
    along = floyd_warshall(lengths)
    found = distances(vertices, faces, np.arange(len(vertices)))
    assert (found <= along + 1e-12).all()
    true = np.arccos(np.clip(vertices @ vertices.T, -1, 1))
    assert (found - true).mean() < 0.3 * (along - true).mean()


@pytest.mark.parametrize("name", ["tetrahedron", "box", "sphere", "sheet", "torus", "fin", "bumpy"])
def test_they_are_a_metric_not_shorter_than_straight_lines(name):
    vertices, faces = FAMILY[name]
    found = distances(vertices, faces, np.arange(len(vertices)))
    straight = np.linalg.norm(vertices[:, None] - vertices, axis=2)
    np.testing.assert_allclose(found, found.T, atol=1e-12)
    assert (found >= straight - 1e-12).all()
    assert (found[:, :, None] + found[None] >= found[:, None, :] - 1e-12).all()
    turned = distances(2 * vertices @ rotation().T + 5, faces, np.arange(len(vertices)))
    np.testing.assert_allclose(turned, 2 * found, rtol=1e-9)


def test_flat_they_are_exact_where_a_way_crosses_one_edge():
    vertices, faces = grid(1, 1)
    np.testing.assert_allclose(distances(vertices, faces, np.array([1]))[0], [1, 0, np.sqrt(2), 1])


def test_round_a_box_they_unfold():
    """From a corner over an edge to the opposite corner: the unfolded diagonal of two squares, or more."""
    vertices, faces = box(1, 1, 1)
    across = np.linalg.norm(vertices[:, None] - vertices, axis=2)
    found = distances(vertices, faces, np.arange(8))
    opposite = np.isclose(across, np.sqrt(3))
    assert (found[opposite] <= 1 + np.sqrt(2) + 1e-12).all()
    assert (found[opposite] >= np.sqrt(5) - 1e-12).all()
    assert np.isclose(found[opposite], np.sqrt(5)).any()


def test_no_way_crosses_outside_its_two_faces():
    """A dart: the straight line between the far corners leaves the faces, so the path bends round the corner."""
    vertices = np.array([[0, 0, 0], [0, 1, 0], [-1, -1, 0], [1, -1, 0]], dtype=float)
    faces = np.array([[0, 1, 2], [1, 0, 3]])
    assert distances(vertices, faces, np.array([2]))[0, 3] == pytest.approx(2 * np.sqrt(2))


def test_vertices_at_the_same_point_are_one_and_pieces_are_far():
    vertices, faces = sphere(1)
    doubled = np.vstack([vertices, vertices])[np.arange(2 * len(vertices))]
    split = faces.copy()
    split[::2] += len(vertices)
    found = distances(doubled, split, np.array([0, len(vertices)]))
    np.testing.assert_allclose(found[0], found[1])
    np.testing.assert_allclose(found[0][: len(vertices)], distances(vertices, faces, np.array([0]))[0])
    pair, pair_faces = joined(sphere(1), sphere(1))
    apart = distances(pair, pair_faces, np.array([0]))[0]
    assert (apart[len(vertices) :] == apart[: len(vertices)].max()).all()


def test_order_and_repetition_of_sources_do_not_matter():
    vertices, faces = bumpy(3)
    whole = distances(vertices, faces, np.arange(len(vertices)))
    np.testing.assert_array_equal(distances(vertices, faces, np.array([9, 2, 9])), whole[[9, 2, 9]])


def test_bad_meshes_have_distances():
    for vertices, faces in (fin(), (np.eye(3)[[0, 0, 1, 2]], np.array([[0, 1, 2], [0, 2, 3], [1, 1, 3]]))):
        found = distances(vertices, faces, np.arange(len(vertices)))
        assert np.isfinite(found).all()
