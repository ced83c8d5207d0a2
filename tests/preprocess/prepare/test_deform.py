from dataclasses import replace

import numpy as np
import pytest
from prepared import raw_mesh, soup
from shapes import FAMILY, bumpy, sphere

from meshshard.errors import InvalidMesh
from meshshard_prep.prepare import deform
from meshshard_prep.prepare.deform import deformed

SEED = [7, 1]


def radius(points):
    return np.linalg.norm(points - points.mean(axis=0), axis=1).max()


@pytest.mark.parametrize("name", FAMILY)
def test_another_shape_of_the_same_faces(name):
    mesh = raw_mesh(*FAMILY[name])
    first, again, other = deformed(mesh, SEED), deformed(mesh, SEED), deformed(mesh, [7, 2])
    np.testing.assert_array_equal(first.faces, mesh.faces)
    np.testing.assert_array_equal(first.vertices, again.vertices)
    for one, two in ((first, mesh), (other, mesh), (first, other)):
        way = np.linalg.norm(one.vertices - two.vertices, axis=1) / radius(mesh.vertices)
        assert 0.005 < way.mean() < 0.6


@pytest.mark.parametrize("name", FAMILY)
def test_size_and_place_come_back(name):
    vertices, faces = FAMILY[name]
    moved = deformed(raw_mesh(vertices * 1000 - 4e4, faces), SEED)
    np.testing.assert_allclose(
        moved.vertices, deformed(raw_mesh(vertices, faces), SEED).vertices * 1000 - 4e4, atol=1e-6
    )


def test_points_at_one_place_stay_together():
    vertices, faces = sphere(1)
    mesh = raw_mesh(*soup(vertices, faces))
    assert len(np.unique(deformed(mesh, SEED).vertices, axis=0)) == len(vertices)


def only(monkeypatch, **kept):
    """All deviations 0 but these."""
    for name in ("THICKNESS", "GROWTH", "STRETCH", "NOISE"):
        monkeypatch.setattr(deform, name, 0.0)
    for name, value in kept.items():
        monkeypatch.setattr(deform, name, value)


def test_without_deviations_the_mesh_stays_as_it_is(monkeypatch):
    only(monkeypatch)
    mesh = raw_mesh(*bumpy(3))
    np.testing.assert_allclose(deformed(mesh, SEED).vertices, mesh.vertices, atol=1e-12)


def test_a_sphere_that_is_thicker_everywhere_is_a_sphere(monkeypatch):
    only(monkeypatch, THICKNESS=0.02, THICKENED=1e6)
    vertices, faces = sphere(3)
    lengths = np.linalg.norm(deformed(raw_mesh(vertices, faces), SEED).vertices, axis=1)
    assert abs(lengths - 1).min() > 1e-3
    np.testing.assert_allclose(lengths, lengths.mean(), atol=1e-4)


def test_growth_about_wide_places_is_a_larger_or_smaller_mesh(monkeypatch):
    only(monkeypatch, GROWTH=0.1, GROWN=1e6)
    mesh = raw_mesh(*bumpy(5))
    moved = deformed(mesh, SEED).vertices
    ends = mesh.faces[:, :2]
    edges = [np.diff(points[ends], axis=1) for points in (moved, mesh.vertices)]
    after, before = (np.linalg.norm(edge, axis=2) for edge in edges)
    ratio = after / before
    assert abs(ratio.mean() - 1) > 1e-3
    np.testing.assert_allclose(ratio, ratio.mean(), rtol=1e-9)


def test_stretching_is_linear(monkeypatch):
    only(monkeypatch, STRETCH=0.1)
    vertices, faces = bumpy(2)
    moved = deformed(raw_mesh(vertices, faces), SEED).vertices
    left = np.linalg.lstsq(np.c_[vertices, np.ones(len(vertices))], moved, rcond=None)
    assert left[1].max() < 1e-20
    np.testing.assert_allclose(left[0][:3], left[0][:3].T, atol=1e-12)


def test_a_mesh_that_breaks_a_rule_is_refused_by_it():
    vertices, faces = sphere(1)
    mesh = raw_mesh(vertices, faces)
    with pytest.raises(InvalidMesh, match="face indices lie between 0 and 17"):
        deformed(replace(mesh, faces=faces + 1000), SEED, place="a.obj")
