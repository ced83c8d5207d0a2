from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
from shapes import FAMILY, bumpy, grid, joined, rotation, sphere

from meshshard.errors import InvalidMesh, UsageError
from meshshard.recipe import RECIPES
from meshshard_prep.clean import clean
from meshshard_prep.features import hks
from meshshard_prep.features.hks import heat_kernel_signature
from meshshard_prep.features.laplacian import laplacian
from meshshard_prep.formats import read_mesh
from meshshard_prep.pipeline import compute_features

PAPER = RECIPES["paper"]
PLAIN = replace(PAPER, name="plain", laplacian="cotangent")
TIMES = np.array(PAPER.times)


def signature(vertices, faces, times=PAPER.times, recipe=PAPER):
    return heat_kernel_signature(*laplacian(vertices, faces, recipe), times).values


def full_spectrum(stiffness, mass, times=TIMES):
    """The definition, by dense LAPACK: every eigenpair."""
    root = 1 / np.sqrt(mass)
    eigenvalues, vectors = scipy.linalg.eigh(root[:, None] * stiffness.toarray() * root)
    return np.square(root[:, None] * vectors) @ np.exp(-np.outer(eigenvalues, times))


def sliver():
    """A bumpy sphere with a vertex very near to another one: faces with areas of 1e-9."""
    vertices, faces = bumpy(2)
    a, b, c = faces[0]
    near = vertices[a] * (1 - 1e-7) + vertices[[b, c]].mean(axis=0) * 1e-7
    new = len(vertices)
    return np.vstack([vertices, near]), np.vstack([faces[1:], [[a, b, new], [b, c, new], [c, a, new]]])


def with_collinear_faces():
    """A sheet in which a vertex has only faces without area."""
    vertices, faces = grid(3, 3)
    a, b = faces[0, :2]
    new = len(vertices)
    return np.vstack([vertices, (vertices[a] + vertices[b]) / 2]), np.vstack([faces, [[a, b, new]]])


def test_approaches_the_spheres_closed_form():
    """On the unit sphere HKS(t) = sum over l of (2 l + 1) / (4 pi) exp(-l (l + 1) t), at every point."""
    degree = np.arange(200)
    exact = ((2 * degree + 1) / (4 * np.pi)) @ np.exp(-np.outer(degree * (degree + 1), TIMES[11:]))
    errors = [np.abs(signature(*sphere(level), times=PAPER.times[11:]) / exact - 1).max() for level in (2, 3, 4)]
    assert errors[0] > 3.5 * errors[1] > 3.5**2 * errors[2]  # second order
    assert errors[2] < 0.01


HARD = FAMILY | {
    "sliver": sliver(),
    "bumpy-fine": bumpy(3, 3),
    "tiny-piece": joined(sphere(2), (1e-3 * sphere(0)[0], sphere(0)[1])),
}


@pytest.mark.parametrize(
    "recipe", [PAPER, PLAIN, replace(PLAIN, regularisation=1e-8)], ids=["robust", "plain", "lifted"]
)
@pytest.mark.parametrize("name", HARD)
def test_within_its_bound_of_the_full_spectrum(name, recipe):
    stiffness, mass = laplacian(*HARD[name], recipe)
    found = heat_kernel_signature(stiffness, mass, PAPER.times)
    error = np.abs(found.values / full_spectrum(stiffness, mass) - 1).max()
    assert error <= found.error_bound <= 1e-5


@pytest.mark.parametrize("name", [n for n in FAMILY if n != "pieces"])
def test_against_the_matrix_exponential(name):
    """An independent road: no eigenvalue is computed, and no rational sum."""
    stiffness, mass = laplacian(*FAMILY[name], PAPER)
    found = heat_kernel_signature(stiffness, mass, PAPER.times)
    operator = stiffness.toarray() / mass[:, None]
    expected = np.stack([np.diag(scipy.linalg.expm(-t * operator)) / mass for t in TIMES], axis=1)
    assert np.abs(found.values / expected - 1).max() <= found.error_bound


@pytest.mark.parametrize(
    "times", [(0.1,), (0.3, 0.1, 0.2), tuple(np.linspace(0.01, 0.5, 7)), tuple(np.geomspace(1e-4, 1, 9))], ids=len
)
def test_any_times(times):
    stiffness, mass = laplacian(*bumpy(1, 3), PAPER)
    found = heat_kernel_signature(stiffness, mass, times)
    error = np.abs(found.values / full_spectrum(stiffness, mass, np.array(times)) - 1).max()
    assert error <= found.error_bound <= 1e-5


@pytest.mark.parametrize("recipe", [PAPER, PLAIN], ids=["robust", "plain"])
@pytest.mark.parametrize("name", FAMILY)
def test_does_not_depend_on_place_turn_mirror_unit_or_numbering(name, recipe):
    """Also where four vertices lie on a circle and rounding decides which way the robust Laplacian flips an edge."""
    vertices, faces = FAMILY[name]
    plain = compute_features(vertices, faces, recipe).hks
    rng = np.random.default_rng(5)
    moved = vertices @ rotation(1) * 3e-4 + [5, -2, 1]
    number = rng.permutation(len(vertices))
    shuffled = np.empty_like(vertices)
    shuffled[number] = vertices
    for other, same in (
        (compute_features(moved, faces, recipe).hks, slice(None)),
        (compute_features(vertices * [1, 1, -1], faces[:, ::-1], recipe).hks, slice(None)),
        (compute_features(vertices * 1e6, faces, recipe).hks, slice(None)),
        (compute_features(vertices * 1e-6, faces, recipe).hks, slice(None)),
        (compute_features(shuffled, number[rng.permutation(faces)], recipe).hks, number),
    ):
        np.testing.assert_allclose(other[same], plain, rtol=1e-6)


def test_noise_changes_it_by_as_much():
    """Three turned squares round a vertex: all edges tie, and noise flips them at random."""
    vertices, faces = grid(6, 6)
    noisy = vertices + 1e-6 * np.random.default_rng(0).standard_normal(vertices.shape)
    np.testing.assert_allclose(signature(noisy, faces), signature(vertices, faces), rtol=1e-4)


def test_scale_by_s_is_time_by_s_squared():
    vertices, faces = FAMILY["bumpy"]
    small = signature(vertices, faces)
    big = signature(3 * vertices, faces, times=tuple(9 * TIMES))
    np.testing.assert_allclose(9 * big, small, rtol=2e-6)


def test_pieces_do_not_feel_each_other():
    vertices, faces = joined(sphere(1), sphere(2))
    alone = signature(*sphere(1))
    np.testing.assert_allclose(signature(vertices, faces)[: len(alone)], alone, rtol=1e-9)


def test_long_times_forget_everything_but_the_area():
    stiffness, mass = laplacian(*FAMILY["bumpy"], PAPER)
    late = heat_kernel_signature(stiffness, mass, (100.0,)).values
    np.testing.assert_allclose(late, 1 / mass.sum(), rtol=1e-6)


def test_a_vertex_without_area_gets_its_neighbours_signature():
    vertices, faces = with_collinear_faces()
    sample = compute_features(vertices, faces)
    assert sample.diagnostics["raised_areas"] == 1
    assert sample.diagnostics["zero_area_faces"] == 1
    a, b = faces[0, :2]
    low, high = sorted([sample.hks[a, 8], sample.hks[b, 8]])
    assert 0.5 * low < sample.hks[-1, 8] < 2 * high


def test_takes_more_poles_when_the_first_sum_is_not_enough(monkeypatch):
    stiffness, mass = laplacian(*FAMILY["bumpy"], PAPER)
    monkeypatch.setattr(hks, "PROMISE", np.inf)  # tries every sum
    assert heat_kernel_signature(stiffness, mass, PAPER.times, tolerance=0.1).poles == 8
    assert heat_kernel_signature(stiffness, mass, PAPER.times, tolerance=1e-5).poles == 16
    assert heat_kernel_signature(stiffness, mass, PAPER.times, tolerance=2e-7).poles == 24


def test_refuses_what_it_cannot_compute_to_the_tolerance():
    stiffness, mass = laplacian(*FAMILY["bumpy"], PAPER)
    with pytest.raises(InvalidMesh, match=r"at most 6.0e-08, but its bound is 6.*e-08 with up to 32 poles.*inexact"):
        heat_kernel_signature(stiffness, mass, PAPER.times, tolerance=6e-8)
    with pytest.raises(UsageError, match=r"32 poles reach a relative error of .*e-04 for times from 1e-06 to 1"):
        heat_kernel_signature(stiffness, mass, tuple(np.geomspace(1e-6, 1, 5)))


def test_refuses_a_piece_that_rounding_would_cool():
    """A hundred million times smaller: what the rows of its Laplacian do not sum to, heat leaks through."""
    small, faces = bumpy(4, 1)
    vertices, faces = joined(sphere(2), (1e-8 * small, faces))
    stiffness, mass = laplacian(vertices, faces, PAPER)
    with pytest.raises(InvalidMesh, match=r"bound is \S+ then \S+ then \S+ with up to 32 poles\. Remove pieces"):
        heat_kernel_signature(stiffness, mass, PAPER.times)


@pytest.mark.data
@pytest.mark.parametrize("name", ["shrec_16", "human_seg"])
def test_real_meshes_are_within_their_bounds(data_root, name):
    """Every fiftieth mesh; all of them were compared once, see docs/features.md."""
    for path in sorted((data_root / name).rglob("*.obj"))[::50]:
        mesh = read_mesh(path)
        clean_mesh = clean(mesh.vertices, mesh.faces, weld=PAPER.weld)
        stiffness, mass = laplacian(clean_mesh.vertices, clean_mesh.faces, PAPER)
        found = heat_kernel_signature(stiffness, mass, PAPER.times)
        error = np.abs(found.values / full_spectrum(stiffness, mass) - 1).max()
        assert error <= found.error_bound <= 3e-6, path.name
