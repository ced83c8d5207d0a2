import numpy as np
import pytest
from prepared import soup, start
from shapes import FAMILY, box, grid, joined, sphere

from meshshard.recipe import Recipe
from meshshard_prep import compute_features
from meshshard_prep.prepare.largest_component import largest_component


@pytest.mark.parametrize("name", [name for name in FAMILY if name != "pieces"])
def test_one_piece_stays_as_it_is(name):
    vertices, faces = FAMILY[name]
    mesh, counts = largest_component(start(vertices, faces))
    assert counts == {"dropped_faces": 0}
    np.testing.assert_array_equal(mesh.faces, faces)


@pytest.mark.parametrize("change", [lambda *mesh: mesh, soup])
def test_area_decides_and_not_the_number_of_faces(change):
    small, large = sphere(3), box(2, 2, 2)
    vertices, faces = joined((0.3 * small[0], small[1]), large)
    mesh, counts = largest_component(start(*change(vertices, faces)))
    assert counts == {"dropped_faces": len(small[1])}
    np.testing.assert_array_equal(mesh.vertices[mesh.faces], (large[0] + [3, 0, 0])[large[1]])
    np.testing.assert_array_equal(mesh.triangle_sources[:, 0], len(small[1]) + np.arange(12))
    np.testing.assert_array_equal(mesh.vertices, change(vertices, faces)[0][mesh.vertex_source])


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 0, 1), (1, 2, 0)])
def test_of_equal_pieces_that_of_the_lowest_face(order):
    vertices, faces = joined(box(), box(), box())
    faces = faces.reshape(3, 12, 3)[list(order)].reshape(-1, 3)
    mesh, counts = largest_component(start(vertices, faces))
    assert counts == {"dropped_faces": 24}
    np.testing.assert_array_equal(mesh.vertex_source, 8 * order[0] + np.arange(8))


def test_pieces_that_share_a_point_are_one():
    vertices, faces = joined(box(), box(), step=1.0)
    assert largest_component(start(vertices, faces))[1] == {"dropped_faces": 0}
    apart, _ = joined(box(), box(), step=1.01)
    assert largest_component(start(apart, faces))[1] == {"dropped_faces": 12}


def test_a_face_with_a_repeated_corner_connects_nothing():
    vertices, faces = joined(box(2, 2, 2), box())
    mesh, counts = largest_component(start(vertices, np.vstack([faces, [[0, 0, 1], [0, 8, 8]]])))
    assert counts == {"dropped_faces": 13}  # the second box and the bridge; what lies in the first box stays
    assert len(mesh.vertices) == 8


def test_vertices_that_no_face_uses_stay():
    vertices, faces = joined(box(2, 2, 2), grid(1, 1))
    mesh, _ = largest_component(start(np.vstack([vertices, [[9, 9, 9]]]), faces))
    assert mesh.vertex_source.tolist() == [*range(8), 12]


def test_one_component_is_stored():
    sample = compute_features(*FAMILY["pieces"], Recipe(name="largest", steps=("largest_component",)))
    assert sample.diagnostics["components"] == 1
    assert sample.diagnostics["dropped_faces"] == len(FAMILY["pieces"][1]) - len(sample.faces) > 0
