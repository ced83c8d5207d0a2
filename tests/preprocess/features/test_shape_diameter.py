"""Lengths of rays through a shape, against closed forms."""

import sys

import numpy as np
import pytest
from shapes import box, grid, joined, rotation, sphere

from meshshard import UsageError
from meshshard_prep.features.areas import vertex_areas
from meshshard_prep.features.components import components_of
from meshshard_prep.features.edges import edges_of
from meshshard_prep.features.normals import vertex_normals
from meshshard_prep.features.shape_diameter import HALF_ANGLE, OPEN, cone, shape_diameter


def diameters(vertices, faces):
    _, piece_of = components_of(edges_of(faces), len(vertices))
    areas = vertex_areas(vertices, faces)
    return shape_diameter(vertices, faces, vertex_normals(vertices, faces), areas, piece_of)


def test_rays_are_spread_evenly_over_the_cap():
    rays = cone()
    np.testing.assert_allclose(np.linalg.norm(rays, axis=1), 1)
    assert rays[:, 2].min() > np.cos(HALF_ANGLE)
    middle = [0, 0, (1 + np.cos(HALF_ANGLE)) / 2]  # of a cap, heights being uniform
    np.testing.assert_allclose(rays.mean(axis=0), middle, atol=0.01)


def test_in_a_sphere_they_are_chords():
    """A ray at an angle from the normal is 2 cos(angle) long, and these cosines are uniform from 1/2 to 1."""
    found = diameters(*sphere(4)) * np.sqrt(4 * np.pi)
    np.testing.assert_allclose(found[:, 0], 1.5, rtol=0.03)
    np.testing.assert_allclose(found[:, 1], 1.2, rtol=0.03)


def slab(height):
    """The two sides of a plate, and where their inner vertices are."""
    vertices, faces = grid(12, 12)
    plate = np.column_stack([vertices[:, :2], np.zeros(len(vertices))])
    inner = ((plate[:, :2] > 3) & (plate[:, :2] < 9)).all(axis=1)
    return joined((plate, faces), (plate - [0, 0, height], faces[:, ::-1])), np.tile(inner, 2)


def test_between_two_plates_they_are_the_distance_over_the_cosine():
    (vertices, faces), inner = slab(0.2)
    assert inner.any()
    found = diameters(vertices, faces)[inner] * np.sqrt(vertex_areas(vertices, faces).sum())
    np.testing.assert_allclose(found[:, 0], 0.2 / 0.75, rtol=0.1)
    np.testing.assert_allclose(found[:, 1], 0.2 / 0.9, rtol=0.1)


def test_a_shape_that_is_inside_out_is_as_thick_and_so_is_a_turned_and_larger_one():
    vertices, faces = sphere(3)
    vertices = vertices * [1, 0.5, 0.25] + 0.3 * np.sin(3 * vertices[:, [1, 2, 0]])
    found = diameters(vertices, faces)
    np.testing.assert_allclose(diameters(vertices, faces[:, ::-1]), found, rtol=1e-3)
    np.testing.assert_allclose(diameters(4 * vertices @ rotation().T - 2, faces), found, rtol=2e-3)


def test_pieces_are_turned_one_by_one():
    ball, faces = sphere(2)
    alone = diameters(ball, faces)
    both = diameters(*joined((ball, faces), (ball + 9, faces[:, ::-1])))
    np.testing.assert_allclose(both, np.tile(alone, (2, 1)) / np.sqrt(2), rtol=0.05)


def test_a_sheet_is_open_and_so_is_a_vertex_without_a_normal():
    assert (diameters(*grid(3, 3)) == OPEN).all()
    vertices, faces = box(1, 1, 1)
    _, piece_of = components_of(edges_of(faces), len(vertices))
    normals = np.zeros_like(vertices)
    assert (shape_diameter(vertices, faces, normals, vertex_areas(vertices, faces), piece_of) == OPEN).all()


def test_without_embree_it_says_so(monkeypatch):
    monkeypatch.setitem(sys.modules, "embreex.mesh_construction", None)
    with pytest.raises(UsageError, match="shape_diameter needs embreex"):
        diameters(*sphere(1))
