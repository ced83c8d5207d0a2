from dataclasses import replace

import numpy as np
import pytest
import torch
from matched import matched_sample
from scipy.linalg import solve

from meshshard import UsageError
from meshshard_train.functional_map import coefficients, functional_maps, map_losses, true_map
from meshshard_train.recipes import paper
from meshshard_train.spectra import spectrum_of

CONFIG = paper("correspondence", eigenfunctions=8)


@pytest.fixture(scope="module")
def spectra():
    return [spectrum_of(matched_sample(number), CONFIG) for number in range(3)]


def random(*shape, seed=0):
    return torch.from_numpy(np.random.default_rng(seed).standard_normal(shape))


def test_eigenfunctions_are_orthonormal_with_the_areas(spectra):
    for spectrum in spectra:
        functions = spectrum.eigenfunctions_VK.double()
        gram = functions.T @ (spectrum.areas_V[:, None] * functions)
        torch.testing.assert_close(gram, torch.eye(8, dtype=torch.float64), atol=1e-5, rtol=0)
        torch.testing.assert_close(coefficients(functions, spectrum), gram, atol=1e-5, rtol=0)


def test_a_spectrum_does_not_depend_on_the_size_of_the_mesh():
    """In the unit of the mesh's radius, as stored, it does: a spike makes everything else smaller."""
    sample = matched_sample(1)
    scaled = {
        "vertex_areas": sample.vertex_areas / 9,
        "eigenvalues": sample.eigenvalues * 9,
        "eigenvectors": sample.eigenvectors * 3,
    }
    plain, smaller = spectrum_of(sample, CONFIG), spectrum_of(matched_sample(1, **scaled), CONFIG)
    for name in ("areas_V", "eigenvalues_K", "eigenfunctions_VK"):
        torch.testing.assert_close(getattr(plain, name), getattr(smaller, name))


def test_maps_are_those_of_an_independent_solver():
    """The normal equations of the whole matrix, as one system of K * K unknowns."""
    first, second = random(3, 5, 7), random(3, 5, 7, seed=1)
    a, b = random(3, 5, seed=2).exp(), random(3, 5, seed=3).exp()
    found = functional_maps(first, second, a, b, 0.1).numpy()
    for pair in range(3):
        one, two = first[pair].numpy(), second[pair].numpy()
        commuting = np.square(a[pair].numpy()[None, :] - b[pair].numpy()[:, None])  # of C diag(a) - diag(b) C
        system = np.kron(np.eye(5), one @ one.T) + 0.1 * np.diag(commuting.ravel())
        expected = solve(system, (two @ one.T).ravel()).reshape(5, 5)
        np.testing.assert_allclose(found[pair], expected, rtol=1e-9)
    torch.testing.assert_close(functional_maps(first[0], second[0], a[0], b[0], 0.1), torch.from_numpy(found[0]))


@pytest.mark.parametrize("direction", range(20))
def test_no_other_map_has_a_lower_energy(direction):
    first, second, a, b = random(5, 7), random(5, 7, seed=1), random(5, seed=2).exp(), random(5, seed=3).exp()

    def energy(c):
        commuting = c @ a.diag() - b.diag() @ c
        return (c @ first - second).square().sum() + 0.1 * commuting.square().sum()

    best = functional_maps(first, second, a, b, 0.1)
    assert energy(best) < energy(best + 1e-3 * random(5, 5, seed=direction))


def test_gradients_of_maps():
    inputs = [random(2, 4, 6, seed=seed).requires_grad_() for seed in (0, 1)]
    values = [random(2, 4, seed=seed).exp() for seed in (2, 3)]
    assert torch.autograd.gradcheck(lambda a, b: functional_maps(a, b, *values, 1e-3), inputs)


def test_gradients_of_losses(spectra):
    sizes = [len(spectrum.areas_V) for spectrum in spectra[:2]]
    coordinates = random(sum(sizes), 10).requires_grad_()
    pairs = ((0, 1), (1, 0), (0, 0))
    losses = map_losses(coordinates, tuple(spectra[:2]), pairs, 1e-3)
    losses.sum().backward()
    for seed in range(5):
        way = random(sum(sizes), 10, seed=seed)
        step = 1e-5 * way
        with torch.no_grad():
            up, down = (map_losses(coordinates + s, tuple(spectra[:2]), pairs, 1e-3) for s in (step, -step))
        assert ((up - down).sum() / 2e-5).item() == pytest.approx((coordinates.grad * way).sum().item(), rel=1e-4)


def test_a_mesh_and_itself_have_the_identity(spectra):
    identity = torch.eye(8, dtype=torch.float64)
    for spectrum in spectra:
        torch.testing.assert_close(true_map(spectrum, spectrum), identity, atol=1e-5, rtol=0)
        found = coefficients(random(len(spectrum.areas_V), 12), spectrum)
        maps = functional_maps(found, found, spectrum.eigenvalues_K, spectrum.eigenvalues_K, 1e-3)
        torch.testing.assert_close(maps, identity, atol=1e-8, rtol=0)


@pytest.mark.parametrize("regularisation", [1e-6, 1e-3, 1.0])
def test_an_isometric_mesh_has_the_true_map_whatever_its_numbering(spectra, regularisation):
    """Coordinates that correspond give the map of the correspondence, signs of eigenfunctions included."""
    sample = matched_sample(1)
    order = np.random.default_rng(5).permutation(len(sample.vertices))
    signs = np.where(np.arange(10) % 2, -1, 1).astype("f4")
    changed = {name: getattr(sample, name)[order] for name in ("vertices", "vertex_areas", "hks")}
    changed |= {
        "eigenvectors": sample.eigenvectors[order] * signs,
        "faces": np.argsort(order)[sample.faces].astype("i4"),
    }
    changed |= {"correspondence": np.argsort(order)[sample.correspondence].astype("i4")}
    first, second = spectra[1], spectrum_of(replace(sample, **changed), CONFIG)
    values = random(len(order), 12)
    one, two = coefficients(values, first), coefficients(values[order], second)
    found = functional_maps(one, two, first.eigenvalues_K, second.eigenvalues_K, regularisation)
    torch.testing.assert_close(found, true_map(first, second), atol=1e-5, rtol=0)
    torch.testing.assert_close(found, torch.from_numpy(np.diag(signs[:8]).astype("f8")), atol=1e-5, rtol=0)


def test_the_true_map_is_the_weighted_least_squares_solution(spectra):
    """Against numpy, on meshes that are no isometries; with unknown points, and several at one vertex."""
    first, second = spectra[1], spectra[2]
    points = second.points_M.clone()
    points[5:9], points[20] = -1, points[21]
    second = replace(second, points_M=points)
    known = points.numpy() >= 0
    at_first, at_second = first.points_M.numpy()[known], points.numpy()[known]
    shared = np.array([(at_second == vertex).sum() for vertex in at_second])
    root = np.sqrt(second.areas_V.numpy().astype("f8")[at_second] / shared)[:, None]
    one, two = (s.eigenfunctions_VK.numpy().astype("f8") for s in (first, second))
    expected = np.linalg.lstsq(root * two[at_second], root * one[at_first])[0]
    np.testing.assert_allclose(true_map(first, second), expected, atol=1e-9)


def test_the_true_map_transports_functions(spectra):
    """Smooth functions of the template, on two bodies bent differently: C takes coefficients to coefficients."""
    first, second = spectra[1], spectra[2]
    smooth = torch.cat([random(4, 3), torch.zeros(4, 3)])
    values = second.eigenfunctions_VK.double() @ smooth
    there = torch.zeros_like(values)
    there[first.points_M] = values[second.points_M]  # the same functions, at the vertices of the first
    moved = true_map(first, second) @ coefficients(there, first)
    assert (moved - smooth).norm() < 0.2 * smooth.norm()


def test_few_points_give_the_smallest_map(spectra):
    few = [replace(s, points_M=torch.where(torch.arange(len(s.points_M)) < 5, s.points_M, -1)) for s in spectra]
    found = true_map(few[0], few[1])
    assert torch.linalg.matrix_rank(found) == 5
    at = [spectrum.eigenfunctions_VK[spectrum.points_M[:5]].double() for spectrum in few]
    torch.testing.assert_close(at[1] @ found, at[0], atol=1e-6, rtol=0)


def test_a_map_of_nothing_costs_about_one(spectra):
    sizes = [len(spectrum.areas_V) for spectrum in spectra]
    losses = map_losses(1e-9 * random(sum(sizes), 10), tuple(spectra), ((0, 1), (1, 2), (2, 0)), 1.0)
    assert 0.7 < losses.min() < losses.max() < 1.1


def test_a_mesh_with_too_few_eigenfunctions_is_named():
    small = matched_sample(1, level=0, spectrum=8)
    with pytest.raises(UsageError, match=r"mesh001 has only 6 eigenfunctions, and 8 are asked for: .* --set eigen"):
        spectrum_of(small, CONFIG)


def test_points_at_unreferenced_vertices_are_unknown():
    sample = matched_sample(1)
    hks = sample.hks.copy()
    hks[sample.correspondence[3]] = 0
    points = spectrum_of(replace(sample, hks=hks), CONFIG).points_M
    assert points[3] == -1
    assert (points >= 0).sum() == len(points) - 1
