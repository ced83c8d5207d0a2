import numpy as np
from shapes import FAMILY, box, grid, rotation, sphere

from meshshard_prep.features.normals import vertex_normals


def test_corner_of_a_box_does_not_depend_on_its_triangulation():
    vertices, faces = box(1, 2, 3)
    outward = np.sign(vertices - vertices.mean(axis=0)) / np.sqrt(3)
    np.testing.assert_allclose(vertex_normals(vertices, faces), outward, atol=1e-14)


def test_sphere_normals_are_positions():
    vertices, faces = sphere(3)
    assert (np.einsum("vi,vi->v", vertex_normals(vertices, faces), vertices) > 0.999).all()


def test_turn_with_the_mesh_and_flip_with_the_winding():
    vertices, faces = FAMILY["bumpy"]
    normals, turn = vertex_normals(vertices, faces), rotation()
    np.testing.assert_allclose(vertex_normals(vertices @ turn.T, faces), normals @ turn.T, atol=1e-12)
    np.testing.assert_allclose(vertex_normals(vertices, faces[:, ::-1]), -normals, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-14)


def test_zero_where_undefined():
    vertices, faces = grid(1, 1)
    both_sides = np.vstack([faces, faces[:, ::-1]])
    assert not vertex_normals(vertices, both_sides).any()  # faces that cancel
    lonely = np.vstack([vertices, [[9, 9, 9]]])
    assert not vertex_normals(lonely, faces)[-1].any()  # no face
    line = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0]], dtype=float)
    assert not vertex_normals(line, np.array([[0, 1, 2]])).any()  # no area
