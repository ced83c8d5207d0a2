from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
from shapes import FAMILY, bumpy, grid, joined, rotation, sphere

from meshshard import RECIPES, InvalidMesh, UsageError
from meshshard_prep import compute_features
from meshshard_prep.features.edges import edges_of
from meshshard_prep.features.laplacian import laplacian
from meshshard_prep.features.normals import vertex_normals
from meshshard_prep.operators import exporter, gradient, operators_of, tangent_frames

SPECTRAL = replace(RECIPES["paper"], spectrum=6, name="spectral")
BRIDGED = replace(SPECTRAL, components="bridged")


def matrix(arrays, name):
    parts = (arrays[f"{name}_data"], arrays[f"{name}_indices"], arrays[f"{name}_indptr"])
    return sp.csc_matrix(parts, shape=arrays[f"{name}_shape"])


def of(vertices, faces, recipe=SPECTRAL):
    return operators_of(compute_features(vertices, faces, recipe), recipe)


@pytest.mark.parametrize("seed", range(4))
def test_gradient_of_a_linear_function_on_a_plane_is_constant(seed):
    """In any orientation, with irregular and finely divided triangles, at the border too."""
    rng = np.random.default_rng(seed)
    vertices, faces = grid(6, 7)
    vertices[:, :2] += rng.uniform(-0.3, 0.3, (len(vertices), 2))
    vertices = 10.0**-seed * vertices @ rotation(seed).T
    normal, slope = rotation(seed)[:, 2], rng.standard_normal(3)
    frames = tangent_frames(vertex_normals(vertices, faces))
    x, y = gradient(vertices, edges_of(faces).ends, frames)
    function = vertices @ slope
    found = (x @ function)[:, None] * frames[:, 0] + (y @ function)[:, None] * frames[:, 1]
    expected = slope - (slope @ normal) * normal
    np.testing.assert_allclose(found, np.tile(expected, (len(found), 1)), atol=1e-3 * np.linalg.norm(slope))


def test_gradient_on_the_sphere_approaches_the_closed_form():
    """Of f = z it is the tangential part of the z axis, of length sqrt(1 - z^2). The error falls with the edges."""
    errors = []
    for level in (2, 3, 4):
        vertices, faces = sphere(level)
        frames = tangent_frames(vertex_normals(vertices, faces))
        x, y = gradient(vertices, edges_of(faces).ends, frames)
        length = np.hypot(x @ vertices[:, 2], y @ vertices[:, 2])
        errors.append(np.abs(length - np.sqrt(1 - vertices[:, 2] ** 2)).max())
    assert errors[2] < 0.6 * errors[1] < 0.6 * 0.65 * errors[0]
    assert errors[2] < 0.05


@pytest.mark.parametrize("name", FAMILY)
def test_frames_are_orthonormal_and_right_handed(name):
    frames = tangent_frames(vertex_normals(*FAMILY[name]))
    np.testing.assert_allclose(
        frames @ frames.transpose(0, 2, 1), np.tile(np.eye(3), (len(frames), 1, 1)), atol=1e-14
    )
    np.testing.assert_allclose(np.linalg.det(frames), 1)


def test_an_undefined_normal_has_a_frame_and_finite_gradients():
    """Two faces back to back: all normals cancel."""
    vertices = np.array([[0.0, 0, 0], [0, 0, 1], [0, 1, 0]])
    arrays = of(vertices, [[0, 1, 2], [0, 2, 1]])
    np.testing.assert_array_equal(arrays["frames"][:, 2], np.tile([0, 0, 1], (3, 1)))
    assert all(np.isfinite(array).all() for array in arrays.values())


@pytest.mark.parametrize("recipe", [SPECTRAL, BRIDGED, replace(SPECTRAL, laplacian="cotangent", weld=False)])
@pytest.mark.parametrize("name", FAMILY)
def test_stored_eigenpairs_solve_the_recomputed_problem(name, recipe):
    arrays = of(*FAMILY[name], recipe)
    stiffness, mass = matrix(arrays, "L"), arrays["mass"]
    values, modes = arrays["evals"], arrays["evecs"].astype(float)
    assert len(values) == arrays["k_eig"] == min(6, len(mass))
    np.testing.assert_allclose(modes.T @ (mass[:, None] * modes), np.eye(len(values)), atol=1e-5)
    residual = stiffness @ modes - mass[:, None] * modes * values
    np.testing.assert_allclose(residual, 0, atol=1e-4 * max(1, values[-1]))


@pytest.mark.parametrize("name", ["sheet", "sphere", "torus"])
def test_energy_of_the_gradient_is_the_energy_of_the_laplacian(name):
    """f' L f is the integral of |grad f|^2: for a linear function, the squared tangential part of its slope summed
    over faces. L is symmetric and takes constants to 0."""
    vertices, faces = FAMILY[name]
    arrays = of(vertices, faces)
    stiffness, points = matrix(arrays, "L"), arrays["verts"].astype(float)
    np.testing.assert_allclose((stiffness - stiffness.T).toarray(), 0, atol=1e-6)
    np.testing.assert_allclose(stiffness @ np.ones(len(points)), 0, atol=1e-5)
    slope = np.array([0.3, -0.5, 0.8])
    a, b, c = points[arrays["faces"]].transpose(1, 0, 2)
    normals = np.cross(b - a, c - a)
    area = np.linalg.norm(normals, axis=1) / 2
    tangential = slope @ slope - np.square(normals @ slope / (2 * area))
    energy = points @ slope @ stiffness @ (points @ slope)
    if name == "sheet":  # every Laplacian of a plane agrees on linear functions
        assert energy == pytest.approx((area * tangential).sum(), rel=1e-5)
    x, y = matrix(arrays, "gradX") @ points @ slope, matrix(arrays, "gradY") @ points @ slope
    assert (arrays["mass"] * (x**2 + y**2)).sum() == pytest.approx(energy, rel=0.3 if name == "torus" else 0.06)


def test_the_working_copy_leads_back_to_the_file():
    """A vertex twice, one unused, and a face that welding makes degenerate."""
    vertices, faces = bumpy(3, 1)
    twice = np.vstack([vertices, vertices[4:5], [[9.0, 9, 9]]])
    extra = len(vertices)
    sample = compute_features(twice, np.vstack([faces, [[4, extra, 0]]]), SPECTRAL)
    arrays = operators_of(sample, SPECTRAL)
    assert arrays["vertex_map"][extra] == arrays["vertex_map"][4]
    assert arrays["vertex_map"][extra + 1] == -1
    np.testing.assert_array_equal(arrays["face_map"], np.arange(len(faces)))
    used = arrays["vertex_map"] >= 0
    np.testing.assert_array_equal(arrays["verts"][arrays["vertex_map"][used]], sample.vertices[used])
    np.testing.assert_array_equal(arrays["evecs"][arrays["vertex_map"][used]], sample.eigenvectors[used])
    np.testing.assert_array_equal(arrays["vertex_map"][sample.faces[arrays["face_map"]]], arrays["faces"])


def test_pieces_that_are_bridged_are_bridged_here_too():
    mesh = joined(sphere(1), sphere(1))
    assert (of(*mesh)["evals"] < 1e-9).sum() == 2
    bridged = of(*mesh, BRIDGED)
    assert (bridged["evals"] < 1e-9).sum() == 1
    assert matrix(bridged, "L").nnz > matrix(of(*mesh), "L").nnz


def test_laplacian_is_that_of_the_package():
    vertices, faces = bumpy(0, 2)
    sample = compute_features(vertices, faces, SPECTRAL)
    stiffness, mass = laplacian(sample.vertices.astype(float), faces, SPECTRAL)
    arrays = operators_of(sample, SPECTRAL)
    np.testing.assert_allclose(matrix(arrays, "L").toarray(), stiffness.toarray(), atol=1e-5)
    np.testing.assert_allclose(arrays["mass"], mass, rtol=1e-5)
    np.testing.assert_allclose(arrays["mass"], sample.vertex_areas, rtol=1e-5)


def test_eigenpairs_of_another_mesh_are_refused():
    sample, other = (compute_features(*bumpy(seed, 1), SPECTRAL) for seed in (0, 1))
    mixed = replace(sample, eigenvectors=other.eigenvectors, eigenvalues=other.eigenvalues, id="mixed")
    with pytest.raises(InvalidMesh, match="mixed: stored eigenpairs are those of the stored vertices") as caught:
        operators_of(mixed, SPECTRAL)
    assert caught.value.code == "bad-spectrum"


def test_a_mesh_that_rounding_to_float32_closes_is_refused():
    """A seam narrower than float32 resolves: eigenvectors know it, stored vertices do not."""
    vertices, faces = bumpy(0, 1)
    torn = faces.copy()
    torn[:4] += len(vertices)
    sample = compute_features(np.vstack([vertices, vertices * (1 + 1e-10)]), torn, SPECTRAL)
    assert sample.diagnostics["components"] == 2
    with pytest.raises(InvalidMesh, match="vertices that rounding to float32 made equal"):
        operators_of(sample, SPECTRAL)


def test_a_data_set_without_eigenvectors_says_what_to_type(tmp_path):
    from samples import toy_dataset

    from meshshard import open_dataset

    with pytest.raises(UsageError, match=r"again, with --spectrum 128, then export toy/paper-spectrum128"):
        exporter(open_dataset(toy_dataset(tmp_path)))
