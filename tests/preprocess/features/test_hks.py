import numpy as np
import pytest
import scipy.linalg
import scipy.sparse as sp
from shapes import FAMILY, joined, sphere

from meshshard.errors import InvalidMesh
from meshshard.recipe import RECIPES
from meshshard_prep.features import hks
from meshshard_prep.features.hks import heat_kernel_signature, spectrum
from meshshard_prep.features.laplacian import laplacian

PAPER = RECIPES["paper"]
TIMES = np.array(PAPER.times)


def signature(vertices, faces, times=TIMES, components=1):
    return heat_kernel_signature(*laplacian(vertices, faces, PAPER), times, components=components).values


def test_approaches_the_spheres_closed_form():
    """On the unit sphere HKS(t) = sum over l of (2 l + 1) / (4 pi) exp(-l (l + 1) t), at every point."""
    degree = np.arange(200)
    exact = ((2 * degree + 1) / (4 * np.pi)) @ np.exp(-np.outer(degree * (degree + 1), TIMES[11:]))
    errors = [np.abs(signature(*sphere(level), times=TIMES[11:]) / exact - 1).max() for level in (2, 3, 4)]
    assert errors[0] > 3.5 * errors[1] > 3.5**2 * errors[2]  # second order
    assert errors[2] < 0.01


@pytest.mark.parametrize("name", [n for n in FAMILY if n != "pieces"])
def test_against_the_matrix_exponential(name):
    """An independent road: no eigenvalue is computed."""
    stiffness, mass = laplacian(*FAMILY[name], PAPER)
    found = heat_kernel_signature(stiffness, mass, TIMES, components=1)
    operator = stiffness.toarray() / mass[:, None]
    expected = np.stack([np.diag(scipy.linalg.expm(-t * operator)) / mass for t in TIMES], axis=1)
    np.testing.assert_allclose(found.values, expected, rtol=1e-9)
    assert found.spectrum_size == len(mass)
    assert 6e-8 <= found.error_bound < 1e-10 + 6e-8


def test_scale_by_s_is_time_by_s_squared():
    vertices, faces = FAMILY["bumpy"]
    stiffness, mass = laplacian(vertices, faces, PAPER)
    big_stiffness, big_mass = laplacian(3 * vertices, faces, PAPER)
    small = heat_kernel_signature(stiffness, mass, TIMES, components=1).values
    big = heat_kernel_signature(big_stiffness, big_mass, 9 * TIMES, components=1).values
    np.testing.assert_allclose(9 * big, small, rtol=1e-6)


def test_pieces_do_not_feel_each_other():
    vertices, faces = joined(sphere(1), sphere(2))
    alone = signature(*sphere(1))
    np.testing.assert_allclose(signature(vertices, faces, components=2)[: len(alone)], alone, rtol=1e-9)


def test_long_times_forget_everything_but_the_area():
    stiffness, mass = laplacian(*FAMILY["bumpy"], PAPER)
    late = heat_kernel_signature(stiffness, mass, np.array([100.0]), components=1).values
    np.testing.assert_allclose(late, 1 / mass.sum(), rtol=1e-9)


def test_spectrum_is_mass_orthonormal():
    stiffness, mass = laplacian(*FAMILY["torus"], PAPER)
    eigenvalues, modes = spectrum(stiffness, mass)
    np.testing.assert_allclose(modes.T @ (mass[:, None] * modes), np.eye(len(mass)), atol=1e-10)
    np.testing.assert_allclose(stiffness @ modes, mass[:, None] * modes * eigenvalues, atol=1e-9)


def test_refuses_more_than_it_can_hold(monkeypatch):
    monkeypatch.setattr(hks, "DENSE_LIMIT", 10)
    with pytest.raises(InvalidMesh, match=r"up to 10 vertices, but this mesh has 66.*too-large"):
        signature(*sphere(2))


def test_refuses_a_spectrum_that_contradicts_the_mesh():
    vertices, faces = FAMILY["sphere"]
    with pytest.raises(InvalidMesh, match="bad-spectrum"):
        signature(vertices, faces, components=2)
    stiffness, mass = laplacian(vertices, faces, PAPER)
    with pytest.raises(InvalidMesh, match="bad-spectrum"):
        heat_kernel_signature(sp.csc_matrix(-stiffness), mass, TIMES, components=1)


def test_refuses_what_it_cannot_compute_to_the_tolerance():
    """A piece a hundred million times smaller: the zero eigenvalues are lost in the rounding of the largest."""
    small, faces = sphere(0)
    vertices, faces = joined(sphere(2), (1e-8 * small, faces))
    with pytest.raises(InvalidMesh, match=r"2 components has an eigenvalue 0, to a relative error of 1.0e-05"):
        signature(vertices, faces, components=2)
    stiffness, mass = laplacian(*sphere(1), PAPER)
    with pytest.raises(InvalidMesh, match=r"to a relative error of 1.0e-08"):
        heat_kernel_signature(stiffness, mass, TIMES, components=1, tolerance=1e-8)
