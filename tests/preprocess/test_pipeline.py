import numpy as np
import pytest
import scipy.linalg
from shapes import FAMILY, fin, grid, joined, rotation, sphere

from meshshard.errors import InvalidMesh
from meshshard.recipe import RECIPES, Recipe
from meshshard_prep import compute_features

TIMES = np.logspace(-2, 0, 16)


@pytest.mark.parametrize("recipe", ["paper", "official"])
@pytest.mark.parametrize("name", FAMILY)
def test_fields(name, recipe):
    vertices, faces = FAMILY[name]
    vertices.flags.writeable = faces.flags.writeable = False
    sample = compute_features(vertices, faces, recipe)
    size = len(vertices)
    for field, shape in {
        "vertices": (size, 3),
        "vertex_normals": (size, 3),
        "dihedral": (size,),
        "hks": (size, 16),
        "vertex_areas": (size,),
    }.items():
        values = getattr(sample, field)
        assert values.shape == shape
        assert values.dtype == np.float32
        assert np.isfinite(values).all()
    assert (sample.hks > 0).all()
    assert (np.diff(sample.hks, axis=1) <= 1e-6 * sample.hks[:, 1:]).all()  # heat only leaves
    np.testing.assert_allclose(sample.times, TIMES, rtol=1e-14)
    np.testing.assert_array_equal(sample.faces, faces)
    np.testing.assert_array_equal(sample.face_source, np.arange(len(faces)))
    np.testing.assert_allclose(sample.original_vertices, vertices, atol=1e-6)
    np.testing.assert_allclose(sample.face_areas.sum(), sample.vertex_areas.sum(), rtol=1e-5)
    assert (sample.dihedral_official is None) == (recipe == "paper")


@pytest.mark.parametrize("name", FAMILY)
def test_moved_turned_scaled_and_renumbered(name):
    vertices, faces = FAMILY[name]
    rng = np.random.default_rng(3)
    order = rng.permutation(len(vertices))
    turn = rotation(2)
    expected = compute_features(vertices, faces)
    found = compute_features((40 * vertices @ turn.T + [5, 6, 7])[order], np.argsort(order)[faces])
    np.testing.assert_allclose(found.hks, expected.hks[order], rtol=1e-5)
    np.testing.assert_allclose(found.dihedral, expected.dihedral[order], atol=1e-5)
    np.testing.assert_allclose(found.vertex_normals, expected.vertex_normals[order] @ turn.T, atol=1e-5)
    np.testing.assert_allclose(found.vertices, expected.vertices[order] @ turn.T, atol=1e-5)
    assert found.scale == pytest.approx(40 * expected.scale)
    assert found.diagnostics == expected.diagnostics


def test_published_recipe_against_a_plain_script():
    """Cotangent weights, barycentric mass and HKS written out with loops and a generalised eigensolver."""
    vertices, faces = FAMILY["bumpy"]
    points = vertices - vertices.mean(axis=0)
    points /= np.linalg.norm(points, axis=1).max()
    size = len(points)
    stiffness, mass = np.zeros((size, size)), np.zeros(size)
    for face in faces:
        area = np.linalg.norm(np.cross(points[face[1]] - points[face[0]], points[face[2]] - points[face[0]])) / 2
        mass[face] += area / 3
        for corner in range(3):
            o, i, j = np.roll(face, -corner)
            a, b = points[i] - points[o], points[j] - points[o]
            weight = a @ b / np.linalg.norm(np.cross(a, b)) / 2
            stiffness[[i, j], [i, j]] += weight
            stiffness[[i, j], [j, i]] -= weight
    eigenvalues, modes = scipy.linalg.eigh(stiffness + 1e-8 * np.eye(size), np.diag(mass))
    expected = modes**2 @ np.exp(-np.outer(eigenvalues, TIMES))
    np.testing.assert_allclose(compute_features(vertices, faces, "official").hks, expected, rtol=1e-5)


def test_unreferenced_vertices_change_nothing_but_their_rows():
    vertices, faces = FAMILY["bumpy"]
    expected = compute_features(vertices, faces)
    found = compute_features(np.vstack([[[99, 0, 0]], vertices]), faces + 1)
    for field in ("hks", "dihedral", "vertex_normals", "vertex_areas"):
        assert not getattr(found, field)[0].any()
        np.testing.assert_allclose(getattr(found, field)[1:], getattr(expected, field), rtol=1e-5)
    assert found.diagnostics["unreferenced_vertices"] == 1
    assert found.diagnostics["undefined_normals"] == 1


def test_a_seam_is_no_border():
    """Two halves of a sphere that share no vertex number, as texture seams leave them."""
    vertices, faces = sphere(2)
    upper = (vertices[faces][:, :, 2].mean(axis=1) > 0)[:, None]
    seam = np.where(upper, faces, faces + len(vertices))
    found = compute_features(np.vstack([vertices, vertices]), seam)
    expected = compute_features(vertices, faces)
    np.testing.assert_allclose(found.hks[seam], expected.hks[faces], rtol=1e-5)
    np.testing.assert_array_equal(found.face_adjacency, expected.face_adjacency)
    assert found.diagnostics["boundary_edges"] == 0
    assert found.diagnostics["welded_vertices"] > 0
    official = compute_features(np.vstack([vertices, vertices]), seam, "official")
    assert official.diagnostics["boundary_edges"] > 0  # the published code does not weld


def test_degenerate_faces_keep_their_place():
    vertices, faces = sphere(1)
    with_bad = np.insert(faces, 3, [[5, 5, 2]], axis=0)
    found, expected = compute_features(vertices, with_bad), compute_features(vertices, faces)
    np.testing.assert_array_equal(found.faces, with_bad)
    assert found.face_adjacency[3].tolist() == [-1, -1, -1]
    renumbered = np.where(expected.face_adjacency >= 3, expected.face_adjacency + 1, expected.face_adjacency)
    np.testing.assert_array_equal(np.delete(found.face_adjacency, 3, axis=0), renumbered)
    assert found.diagnostics["degenerate_faces"] == 1
    np.testing.assert_allclose(found.hks, expected.hks, rtol=1e-6)


def test_diagnostics_count_what_is_there():
    assert compute_features(*joined(sphere(1), grid(2, 2))).diagnostics["components"] == 2
    assert compute_features(*grid(3, 2)).diagnostics["boundary_edges"] == 10
    assert compute_features(*fin()).diagnostics["nonmanifold_edges"] == 1
    line = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [1, 1, 0]], dtype=float)
    assert compute_features(line, np.array([[0, 1, 2], [0, 2, 3]])).diagnostics["zero_area_faces"] == 1


def test_same_bytes_every_time_and_whatever_the_threads():
    vertices, faces = FAMILY["bumpy"]
    assert compute_features(vertices, faces).digest == compute_features(vertices, faces).digest


def test_refusals_keep_their_code_and_say_where():
    _, faces = grid(1, 1)
    with pytest.raises(InvalidMesh) as error:
        compute_features(np.zeros((4, 3)), faces)
    assert error.value.code == "no-extent"
    line = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [1, 1, 0]], dtype=float)
    with pytest.raises(InvalidMesh, match="laplacian-not-finite"):
        compute_features(line, np.array([[0, 1, 2], [0, 2, 3]]), "official")


@pytest.mark.parametrize(
    ("vertices", "faces", "message"),
    [
        (np.zeros((4, 2)), [[0, 1, 2]], r"vertices are \(V, 3\) and faces \(F, 3\), not \(4, 2\) and \(1, 3\)"),
        (np.zeros((4, 3)), [[0, 1, 2, 3]], r"not \(4, 3\) and \(1, 4\)"),
        (np.zeros((4, 3)), [[0.0, 1.0, 2.0]], "faces are integers, not float64"),
    ],
)
def test_arrays_of_another_kind_are_refused(vertices, faces, message):
    with pytest.raises(ValueError, match=message):
        compute_features(vertices, faces)


def test_own_recipe():
    sample = compute_features(*sphere(1), Recipe(name="mine", times=(0.5, 2.0)))
    assert sample.hks.shape == (18, 2)
    assert RECIPES["paper"].times[0] == 0.01


@pytest.mark.parametrize("recipe", ["paper", "official"])
def test_an_edge_with_very_many_faces_is_refused(recipe):
    # the robust Laplacian would take a second for 10,000 of them, 100 seconds for 100,000
    tips = np.random.default_rng(0).standard_normal((100_000, 3))
    vertices = np.vstack([[[0, 0, 0], [1, 0, 0]], tips])
    faces = np.array([[0, 1, 2 + tip] for tip in range(len(tips))])
    with pytest.raises(InvalidMesh, match=r"an edge has at most 1000 faces, but one has 100000.*\[crowded-edge\]"):
        compute_features(vertices, faces, recipe)
    with pytest.raises(InvalidMesh, match=r"one has 1001.*\[crowded-edge\]"):
        compute_features(vertices[:1003], faces[:1001], recipe)
