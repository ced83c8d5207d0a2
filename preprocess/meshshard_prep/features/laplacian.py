"""The Laplacian and the lumped mass of a working copy."""

import igl
import numpy as np
import robust_laplacian
import scipy.sparse as sp
from jaxtyping import Float64, Int64

from meshshard.errors import InvalidMesh
from meshshard.recipe import Recipe
from meshshard_prep.features.areas import positive_areas


def laplacian(
    vertices: Float64[np.ndarray, "V 3"], faces: Int64[np.ndarray, "F 3"], recipe: Recipe
) -> tuple[sp.csc_matrix, Float64[np.ndarray, " V"]]:
    """Positive semi-definite Laplacian (V,V) and lumped mass (V,) of a clean mesh: finite, valid indices, every
    vertex in a face with three different corners.

    "robust": Sharp and Crane, A Laplacian for Nonmanifold Triangle Meshes, 2020. "cotangent": Pinkall and Polthier
    1993. The mass is barycentric with both (`positive_areas`). InvalidMesh where an entry is not finite.
    """
    mass = positive_areas(vertices, faces)
    if recipe.laplacian == "robust":
        # not with its own mass: that is of the flipped triangles, and jumps where four vertices lie on a circle
        stiffness, _ = robust_laplacian.mesh_laplacian(vertices, faces)
    else:
        stiffness = -igl.cotmatrix(vertices, faces)
    stiffness = sp.csc_matrix(stiffness)
    if recipe.regularisation:
        stiffness = stiffness + recipe.regularisation * sp.identity(len(vertices), format="csc")
    bad_entries = int((~np.isfinite(stiffness.data)).sum())
    bad_masses = int((~(mass > 0) | ~np.isfinite(mass)).sum())
    if bad_entries or bad_masses:
        raise InvalidMesh(
            "laplacian-not-finite",
            f"the {recipe.laplacian} Laplacian has finite entries and positive masses",
            f"{bad_entries} entries and {bad_masses} masses are not",
            advice="faces without area do this to the cotangent Laplacian: use recipe paper, or repair them"
            if bad_entries
            else "remove vertices whose faces are all in one point, and pieces too small for floating point",
        )
    return stiffness, mass


def symmetric_operator(
    stiffness: sp.csc_matrix, mass: Float64[np.ndarray, " V"]
) -> tuple[sp.csc_matrix, Float64[np.ndarray, " V"]]:
    """A = M^-1/2 L M^-1/2 and the diagonal of M^1/2: A has the eigenvalues of L phi = lambda M phi."""
    root = np.sqrt(mass)
    operator = stiffness.copy()
    operator.data /= root[operator.indices] * np.repeat(root, np.diff(operator.indptr))
    return operator, root
