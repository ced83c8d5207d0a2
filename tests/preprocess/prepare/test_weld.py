import numpy as np
import pytest
from prepared import soup, start
from shapes import FAMILY, box

from meshshard.recipe import Recipe
from meshshard_prep import compute_features
from meshshard_prep.prepare.weld import weld

WELD = Recipe(name="welded", steps=("weld",))


@pytest.mark.parametrize("name", FAMILY)
def test_a_soup_becomes_the_mesh_it_was_cut_from(name):
    vertices, faces = FAMILY[name]
    mesh, counts = weld(start(*soup(vertices, faces)))
    assert len(mesh.vertices) == len(vertices)
    assert counts == {"merged_vertices": 3 * len(faces) - len(vertices)}
    np.testing.assert_array_equal(mesh.vertices[mesh.faces], vertices[faces])
    corner_of = {vertex: corner for corner, vertex in reversed(list(enumerate(faces.ravel())))}
    assert sorted(mesh.vertex_source) == sorted(corner_of.values())  # the first corner at each vertex


@pytest.mark.parametrize("name", FAMILY)
def test_a_mesh_without_doubles_stays_as_it_is(name):
    vertices, faces = FAMILY[name]
    mesh, counts = weld(start(vertices, faces))
    assert counts == {"merged_vertices": 0}
    np.testing.assert_array_equal(mesh.vertices, vertices)
    np.testing.assert_array_equal(mesh.faces, faces)
    np.testing.assert_array_equal(mesh.vertex_source, np.arange(len(vertices)))


def test_features_of_a_welded_soup_are_those_of_the_mesh():
    vertices, faces = FAMILY["bumpy"]
    welded, plain = compute_features(*soup(vertices, faces), WELD), compute_features(vertices, faces)
    np.testing.assert_allclose(welded.hks[welded.faces], plain.hks[plain.faces], rtol=1e-5)
    assert (welded.diagnostics["welded_vertices"], welded.diagnostics["boundary_edges"]) == (0, 0)
    np.testing.assert_array_equal(welded.face_source, np.arange(len(faces)))


def test_vertices_that_no_face_uses_stay_even_at_the_same_point():
    vertices, faces = box()
    mesh, counts = weld(start(np.vstack([vertices, vertices]), faces))
    assert (counts["merged_vertices"], len(mesh.vertices)) == (0, 16)


def test_a_face_that_loses_a_corner_is_kept_and_counted():
    vertices, faces = box()
    sliver = [0, 8, 1]  # vertex 8 lies where vertex 0 does
    sample = compute_features(np.vstack([vertices, vertices[:1]]), np.vstack([faces, [sliver]]), WELD)
    assert sample.faces[-1].tolist() == [0, 0, 1]
    assert (sample.diagnostics["merged_vertices"], sample.diagnostics["degenerate_faces"]) == (1, 1)
