import numpy as np
import pytest
from shapes import FAMILY, grid, sphere

from meshshard.errors import InvalidMesh
from meshshard.recipe import RECIPES, Recipe
from meshshard_prep.features.areas import face_areas
from meshshard_prep.features.laplacian import laplacian

PLAIN = Recipe(name="plain", laplacian="cotangent")


@pytest.mark.parametrize("recipe", [RECIPES["paper"], PLAIN], ids=lambda r: r.laplacian)
@pytest.mark.parametrize("name", FAMILY)
def test_symmetric_positive_and_blind_to_constants(name, recipe):
    vertices, faces = FAMILY[name]
    stiffness, mass = laplacian(vertices, faces, recipe)
    dense = stiffness.toarray()
    size = np.abs(dense).max()
    np.testing.assert_allclose(dense, dense.T, atol=1e-12 * size)
    np.testing.assert_allclose(dense.sum(axis=1), 0, atol=1e-12 * size)
    assert np.linalg.eigvalsh(dense)[0] > -1e-10 * size
    # the tufted cover glues a back to every face and halves: the area is the mesh's, to its mollification
    assert mass.sum() == pytest.approx(face_areas(vertices, faces).sum(), rel=1e-4)


def test_exact_on_linear_functions_inside_a_sheet():
    vertices, faces = grid(6, 6)
    stiffness, _ = laplacian(vertices, faces, PLAIN)
    inside = ((vertices[:, :2] > 0) & (vertices[:, :2] < 6)).all(axis=1)
    assert np.abs((stiffness @ (2 * vertices[:, 0] - 3 * vertices[:, 1]))[inside]).max() < 1e-12


def test_both_agree_on_a_delaunay_mesh():
    vertices, faces = sphere(2)
    robust, _ = laplacian(vertices, faces, RECIPES["paper"])
    plain, _ = laplacian(vertices, faces, PLAIN)
    assert abs(robust - plain).max() < 1e-3 * abs(plain).max()


def test_official_adds_its_identity():
    vertices, faces = sphere(1)
    official, _ = laplacian(vertices, faces, RECIPES["official"])
    plain, _ = laplacian(vertices, faces, PLAIN)
    np.testing.assert_allclose((official - plain).toarray(), 1e-8 * np.eye(len(vertices)), atol=1e-15)


def test_collinear_face_is_refused_by_the_plain_one_and_taken_by_the_robust_one():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [1, 1, 0]], dtype=float)
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    with pytest.raises(InvalidMesh, match="laplacian-not-finite"):
        laplacian(vertices, faces, PLAIN)
    stiffness, mass = laplacian(vertices, faces, RECIPES["paper"])
    assert np.isfinite(stiffness.data).all()
    assert (mass > 0).all()
