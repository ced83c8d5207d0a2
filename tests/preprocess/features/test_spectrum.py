from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
from shapes import FAMILY, bumpy, joined, sphere, tetrahedron

from meshshard.errors import InvalidMesh
from meshshard.recipe import RECIPES
from meshshard_prep.features import spectrum
from meshshard_prep.features.laplacian import laplacian
from meshshard_prep.features.spectrum import lowest_eigenpairs
from meshshard_prep.pipeline import compute_features

PAPER = RECIPES["paper"]


def operators(vertices, faces):
    return laplacian(vertices, faces, PAPER)


@pytest.fixture(params=["dense", "lanczos"])
def solver(request, monkeypatch):
    """Both roads, whatever the size of the piece."""
    if request.param == "lanczos":
        monkeypatch.setattr(spectrum, "DENSE_SIZE", 0)
    return request.param


SHAPES = {"bumpy": bumpy(1, 3), "sphere": sphere(3), "pieces": joined(bumpy(1, 2), sphere(3), tetrahedron())}


@pytest.mark.usefixtures("solver")
@pytest.mark.parametrize("name", SHAPES)
def test_lowest_pairs_are_those_of_the_full_spectrum(name):
    stiffness, mass = operators(*SHAPES[name])
    found = lowest_eigenpairs(stiffness, mass, 12)
    expected = scipy.linalg.eigh(stiffness.toarray(), np.diag(mass), eigvals_only=True)
    np.testing.assert_allclose(found.values, expected[:12], atol=1e-8)
    np.testing.assert_allclose(found.modes.T @ (mass[:, None] * found.modes), np.eye(12), atol=1e-8)
    np.testing.assert_allclose(stiffness @ found.modes, mass[:, None] * found.modes * found.values, atol=1e-6)


@pytest.mark.usefixtures("solver")
def test_each_piece_brings_its_zero():
    stiffness, mass = operators(*joined(sphere(2), bumpy(2, 2), sphere(2)))
    found = lowest_eigenpairs(stiffness, mass, 6)
    assert (np.abs(found.values) < 1e-9).sum() == 3
    assert found.values[3] > 0.1


@pytest.mark.usefixtures("solver")
def test_is_reproducible_and_signs_are_fixed():
    stiffness, mass = operators(*SHAPES["bumpy"])
    first, second = lowest_eigenpairs(stiffness, mass, 9), lowest_eigenpairs(stiffness, mass, 9)
    np.testing.assert_array_equal(first.modes, second.modes)
    largest = np.argmax(np.abs(first.modes), axis=0)
    assert (first.modes[largest, range(9)] > 0).all()


@pytest.mark.parametrize(("count", "cut"), [(1, False), (2, True), (3, True), (4, False), (5, True)])
def test_says_when_a_cluster_is_cut(count, cut):
    """The octahedral sphere's second eigenvalue is threefold, the third twofold."""
    assert lowest_eigenpairs(*operators(*sphere(2)), count).cut is cut


@pytest.mark.usefixtures("solver")
def test_more_pieces_than_pairs_asked_for():
    """Thirty zeros, of which five are wanted: a cut cluster that goes on beyond all that is computed."""
    pieces = joined(*[bumpy(number, 1) for number in range(30)])
    found = lowest_eigenpairs(*operators(*pieces), 5)
    np.testing.assert_allclose(found.values, 0, atol=1e-9)
    assert found.cut


def test_a_small_mesh_has_fewer():
    found = lowest_eigenpairs(*operators(*tetrahedron()), 10)
    assert (len(found.values), found.modes.shape, found.cut) == (4, (4, 4), False)


def test_refuses_when_one_is_missed(monkeypatch):
    whole = spectrum._of_piece

    def without_the_third(operator, count):
        values, vectors = whole(operator, count + 1)
        return np.delete(values, 2), np.delete(vectors, 2, axis=1)

    monkeypatch.setattr(spectrum, "_of_piece", without_the_third)
    with pytest.raises(InvalidMesh, match=r"(\d+) eigenvalues lie below .* were found.*bad-spectrum"):
        lowest_eigenpairs(*operators(*SHAPES["bumpy"]), 5)


def test_refuses_what_is_no_eigenpair(monkeypatch):
    monkeypatch.setattr(
        spectrum, "_of_piece", lambda operator, count: (np.arange(count + 0.0), np.eye(operator.shape[0], count))
    )
    with pytest.raises(InvalidMesh, match=r"residual of at most 1e-06.*bad-spectrum"):
        lowest_eigenpairs(*operators(*SHAPES["bumpy"]), 5)


def test_refuses_what_does_not_converge(monkeypatch):
    def fail(*_, **__):
        raise spectrum.ArpackError(-9999)

    monkeypatch.setattr(spectrum, "DENSE_SIZE", 0)
    monkeypatch.setattr(spectrum, "eigsh", fail)
    with pytest.raises(InvalidMesh, match=r"13 eigenpairs converge.*bad-spectrum"):
        lowest_eigenpairs(*operators(*SHAPES["bumpy"]), 5)


def test_sample_carries_them_padded():
    vertices, faces = FAMILY["tetrahedron"]
    sample = compute_features(np.vstack([vertices, [[9, 9, 9]]]), faces, replace(PAPER, spectrum=6))
    assert np.isnan(sample.eigenvalues).tolist() == [False] * 4 + [True] * 2
    assert sample.eigenvectors.shape == (5, 6)
    assert not sample.eigenvectors[4].any()
    assert not sample.eigenvectors[:, 4:].any()
    assert compute_features(*sphere(2), replace(PAPER, spectrum=2)).diagnostics["cut_clusters"] == 1
