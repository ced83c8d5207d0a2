import numpy as np
import pytest
from shapes import FAMILY, box, sphere

from meshshard.errors import InvalidMesh
from meshshard_prep.clean import clean


def soup(vertices, faces):
    """Every face with corners of its own, as an STL file has it."""
    return vertices[faces.ravel()], np.arange(faces.size).reshape(-1, 3)


@pytest.mark.parametrize("name", FAMILY)
def test_a_clean_mesh_stays_as_it_is(name):
    vertices, faces = FAMILY[name]
    vertices.flags.writeable = faces.flags.writeable = False
    mesh = clean(vertices, faces, weld=True)
    np.testing.assert_array_equal(mesh.faces, faces)
    np.testing.assert_array_equal(mesh.vertex_map, np.arange(len(vertices)))
    np.testing.assert_array_equal(mesh.face_map, np.arange(len(faces)))
    np.testing.assert_allclose(mesh.positions.mean(axis=0), 0, atol=1e-14)
    assert np.linalg.norm(mesh.positions, axis=1).max() == pytest.approx(1, abs=1e-14)
    np.testing.assert_allclose(mesh.positions * mesh.scale + mesh.centre, vertices, atol=1e-12)
    assert mesh.welded_vertices == 0


@pytest.mark.parametrize("name", FAMILY)
def test_a_soup_is_welded_to_the_mesh_it_came_from(name):
    vertices, faces = FAMILY[name]
    mesh = clean(*soup(vertices, faces), weld=True)
    assert len(mesh.vertices) == len(vertices)
    assert mesh.welded_vertices == faces.size - len(vertices)
    np.testing.assert_array_equal(mesh.vertices[mesh.vertex_map], mesh.positions)
    assert len(clean(*soup(vertices, faces), weld=False).vertices) == faces.size


def test_negative_zero_is_zero():
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [-0.0, 0, 0], [0, 0, 1]])
    assert clean(vertices, np.array([[0, 1, 2], [3, 1, 4]]), weld=True).vertex_map.tolist() == [0, 1, 2, 0, 3]


def test_degenerate_faces_and_unreferenced_vertices_are_left_out():
    vertices, faces = sphere(1)
    lonely = np.vstack([[[50, 50, 50]], vertices, [[9, 9, 9]]])
    bad = np.vstack([[[1, 1, 2]], faces + 1, [[3, 3, 3]]])
    mesh = clean(lonely, bad, weld=True)
    np.testing.assert_array_equal(mesh.faces, faces)
    np.testing.assert_array_equal(mesh.face_map, 1 + np.arange(len(faces)))
    assert mesh.vertex_map.tolist() == [-1, *range(len(vertices)), -1]
    # they do not move or shrink the mesh either
    np.testing.assert_allclose(mesh.vertices, clean(vertices, faces, weld=True).vertices, atol=1e-15)
    assert mesh.to_vertices(np.ones(len(mesh.vertices))).tolist() == [0] + [1] * len(vertices) + [0]


@pytest.mark.parametrize("scale", [1e-6, 1e-3, 1e6])
def test_scale_and_place_do_not_matter(scale):
    vertices, faces = FAMILY["bumpy"]
    moved = clean(scale * vertices + scale * 10, faces, weld=True)
    np.testing.assert_allclose(moved.positions, clean(vertices, faces, weld=True).positions, atol=1e-12)


NAN = np.array([[0, 0, 0], [1, 0, 0], [0, np.nan, 0]])
POINT = np.ones((3, 3))
HUGE = 1e200 * np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]])
TRIANGLE = np.array([[0, 1, 2]])
FAR = np.array([[0, 0, 0], [1, 0, 0], [0, 0, 1], [0, 1e39, 0]])


@pytest.mark.parametrize(
    ("vertices", "faces", "message"),
    [
        (np.zeros((0, 3)), TRIANGLE, r"a mesh has vertices.*\[no-vertices\]"),
        (NAN, np.zeros((0, 3), dtype=int), r"a mesh has faces.*\[no-faces\]"),
        (box()[0], np.array([[0, 1, 8]]), r"between 0 and 7, but there is 8\. Count from 0.*\[index-out-of-range\]"),
        (box()[0], np.array([[0, 1, -2]]), r"there is -2\..*\[index-out-of-range\]"),
        (NAN, TRIANGLE, r"vertex 2 is \[0.0, nan, 0.0\] \(1 such vertices\)\. .*\[not-finite\]"),
        (POINT, TRIANGLE, r"distance from its centre is 0.0.*\[no-extent\]"),
        (HUGE, TRIANGLE, r"distance from its centre is inf.*\[no-extent\]"),
        (box()[0], np.array([[0, 0, 1], [2, 3, 2]]), r"all 2 are degenerate\. Look .*\[no-faces\]"),
        (FAR, TRIANGLE, r"vertex 3, which no face uses, is \[0.0, 1e\+39, 0.0\] \(1 such vertices\).*\[far-vertex\]"),
        (FAR * [1, 1e269, 1], TRIANGLE, r"vertex 3.*\[far-vertex\]"),
    ],
)
def test_refusals(vertices, faces, message):
    with pytest.raises(InvalidMesh, match="here.obj: .*" + message):
        clean(vertices, faces, weld=True, place="here.obj")
