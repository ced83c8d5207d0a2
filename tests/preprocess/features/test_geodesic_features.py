"""Distances and discs on the surface, against closed forms and without landmarks."""

import numpy as np
import pytest
from shapes import FAMILY, joined, rotation, sphere

from meshshard_prep.features import geodesic
from meshshard_prep.features.areas import vertex_areas
from meshshard_prep.features.geodesic import RADII, SOFTNESS, geodesic_features


def features(vertices, faces):
    return geodesic_features(vertices, faces, vertex_areas(vertices, faces))


def test_on_a_sphere_they_are_those_of_the_closed_form():
    """All points are at the mean distance of a quarter turn, and the farthest is opposite; a disc is a cap with a
    soft edge, integrated here over the angle."""
    found = features(*sphere(4))
    unit = np.sqrt(4 * np.pi)
    np.testing.assert_allclose(found[:, 0], np.pi / 2 / unit, rtol=0.03)
    np.testing.assert_allclose(found[:, 1], np.pi / unit, rtol=0.05)
    angle = np.linspace(0, np.pi, 20001)
    for number, radius in enumerate(RADII):
        inside = 1 / (1 + np.exp((angle / unit / radius - 1) / SOFTNESS))
        area = np.trapezoid(inside * np.sin(angle) / 2, angle)
        if radius >= 0.12:  # smaller discs hold only some vertices of this mesh
            np.testing.assert_allclose(found[:, 2 + number], area / (np.pi * radius**2), rtol=0.1)


@pytest.mark.parametrize("name", ["sphere", "torus", "bumpy", "sheet", "fin"])
def test_position_size_turn_and_numbering_change_nothing(name):
    vertices, faces = FAMILY[name]
    rng = np.random.default_rng(0)
    vertices = vertices + 0.01 * rng.normal(size=vertices.shape)  # no two points are equally far
    found = features(vertices, faces)
    assert (found > 0).all()
    np.testing.assert_allclose(features(3 * vertices @ rotation().T + 7, faces), found, rtol=1e-6)
    order = rng.permutation(len(vertices))
    number = np.argsort(order)
    np.testing.assert_allclose(features(vertices[order], number[faces]), found[order], rtol=1e-6)


def test_a_piece_has_its_own_distances_and_the_unit_is_of_the_whole():
    vertices, faces = sphere(2)
    alone = features(vertices, faces)
    both = features(*joined((vertices, faces), (vertices + 5, faces)))
    np.testing.assert_allclose(both[:, :2], np.tile(alone[:, :2], (2, 1)) / np.sqrt(2), rtol=1e-6)


def test_landmarks_stand_for_all_vertices(monkeypatch):
    vertices, faces = sphere(3)
    stretched = vertices * [1, 0.4, 2]
    whole = features(stretched, faces)
    assert len(vertices) <= geodesic.LANDMARKS
    monkeypatch.setattr(geodesic, "LANDMARKS", 100)
    found = features(stretched, faces)
    np.testing.assert_allclose(found[:, 0], whole[:, 0], rtol=0.02)
    np.testing.assert_allclose(found[:, 6:], whole[:, 6:], rtol=0.2)


def test_a_thin_limb_has_small_discs_and_its_end_is_far():
    vertices, faces = sphere(4)
    ball, found = features(vertices, faces), features(vertices * [0.2, 0.2, 3], faces)
    end, middle = vertices[:, 2].argmax(), np.abs(vertices[:, 2]).argmin()
    assert found[end, 0] > 1.5 * found[middle, 0]
    assert (found[[end, middle], 7] < 0.8 * ball[[end, middle], 7]).all()
