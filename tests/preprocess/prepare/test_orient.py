import numpy as np
import pytest
from prepared import soup, start, volume
from shapes import FAMILY, box, fin, grid, joined, sphere, tetrahedron, torus

from meshshard_prep.facts import disagreeing
from meshshard_prep.features.edges import edges_of
from meshshard_prep.prepare.orient import orient

CLOSED = {
    "tetrahedron": (*tetrahedron(), 8 / 3),
    "box": (*box(1, 2, 3), 6.0),
    "far box": (box(1, 2, 3)[0] + 1000, box()[1], 6.0),
    "boxes": (*joined(box(), box(2, 1, 1)), 3.0),
    "octahedron": (*sphere(0), 4 / 3),
    "torus": (*torus(12, 8), None),
    "bumpy": (*FAMILY["bumpy"], None),
}
SEEDS = range(5)


def flipped(faces, seed, share=0.5):
    """Some faces with reversed corners, and which."""
    rows = np.random.default_rng(seed).random(len(faces)) < share
    return np.where(rows[:, None], faces[:, ::-1], faces), rows


def at_odds(faces):
    return int(disagreeing(faces, edges_of(faces)).sum())


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("name", CLOSED)
def test_closed_meshes_face_outwards_whatever_was_flipped(name, seed):
    vertices, faces, expected = CLOSED[name]
    mixed, rows = flipped(faces, seed)
    mesh, counts = orient(start(vertices, mixed))
    assert at_odds(mesh.faces) == 0
    assert counts == {"turned_faces": rows.sum()}
    np.testing.assert_array_equal(mesh.faces, faces)
    if expected is not None:
        assert volume(mesh) == pytest.approx(expected, rel=1e-6)
    assert volume(mesh) > 0


@pytest.mark.parametrize("name", CLOSED)
def test_a_mesh_inside_out_is_turned_whole(name):
    vertices, faces, _ = CLOSED[name]
    assert orient(start(vertices, faces[:, ::-1]))[1] == {"turned_faces": len(faces)}


@pytest.mark.parametrize("share", [0.2, 0.8])
@pytest.mark.parametrize("seed", SEEDS)
def test_an_open_sheet_is_wound_as_most_of_its_faces_were(seed, share):
    vertices, faces = grid(8, 6)
    mixed, rows = flipped(faces, seed, share)
    mesh, counts = orient(start(vertices, mixed))
    assert counts == {"turned_faces": min(rows.sum(), len(faces) - rows.sum())}
    np.testing.assert_array_equal(mesh.faces, faces if share < 0.5 else faces[:, ::-1])


@pytest.mark.parametrize("seed", SEEDS)
def test_seams_do_not_hide_neighbours(seed):
    vertices, faces = torus()
    mixed, rows = flipped(faces, seed)
    mesh, counts = orient(start(*soup(vertices, mixed)))
    assert counts == {"turned_faces": rows.sum()}
    np.testing.assert_allclose(mesh.vertices[mesh.faces], vertices[faces])


def test_each_closed_piece_is_turned_outwards_also_inside_another():
    vertices, faces = joined(sphere(2), sphere(1), step=0.0)
    vertices[66:] *= 0.5
    faces[128:] = faces[128:, ::-1]  # as the inner wall of a hollow ball would be
    mesh, counts = orient(start(vertices, faces))
    assert counts == {"turned_faces": 32}
    assert volume(mesh) == pytest.approx(volume(start(*sphere(2))) + volume(start(*sphere(1))) / 8)


def test_a_fin_does_not_keep_a_body_from_being_closed():
    vertices, faces = fin()
    mesh, counts = orient(start(vertices, np.vstack([faces[:-1, ::-1], faces[-1:]])))
    assert counts == {"turned_faces": len(faces) - 1}
    np.testing.assert_array_equal(mesh.faces, faces)


def moebius(size):
    """A band of 2 * size triangles with a half turn."""
    at = np.arange(2 * size + 2)
    at[-2:] = 1, 0
    return np.array([t for i in range(0, 2 * size, 2) for t in (at[[i, i + 1, i + 2]], at[[i + 1, i + 3, i + 2]])])


@pytest.mark.parametrize("seed", SEEDS)
def test_a_moebius_strip_is_cut_once(seed):
    faces = moebius(20)
    vertices = np.random.default_rng(seed).random((40, 3))
    mixed, _ = flipped(faces, seed)
    mesh, counts = orient(start(vertices, mixed))
    assert at_odds(mesh.faces) == 1
    assert counts["turned_faces"] <= len(faces) / 2
    assert counts["turned_faces"] == (mesh.faces != mixed).any(axis=1).sum()


def test_faces_with_a_repeated_corner_are_left_alone():
    vertices, faces = box()
    mesh, counts = orient(start(vertices, np.vstack([faces[:, ::-1], [[0, 0, 1]]])))
    assert counts == {"turned_faces": 12}
    assert mesh.faces[-1].tolist() == [0, 0, 1]
