"""The heat kernel signature. The one place to change for a faster engine."""

from dataclasses import dataclass

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from jaxtyping import Float64

from meshshard.errors import InvalidMesh

DENSE_LIMIT = 10_000
"""Most vertices the dense engine takes: three matrices of 800 MB, minutes of time."""


FLOAT32_ROUNDING = 6e-8
"""Half a unit in the last place of a stored value."""


@dataclass(frozen=True, eq=False)
class HeatKernelSignature:
    """`values` (V,T), how many eigenpairs they were summed over, and the bound of their relative error."""

    values: Float64[np.ndarray, "V T"]
    spectrum_size: int
    error_bound: float


def heat_kernel_signature(
    stiffness: sp.csc_matrix,
    mass: Float64[np.ndarray, " V"],
    times: Float64[np.ndarray, " T"],
    *,
    components: int,
    tolerance: float = 1e-5,
    regularisation: float = 0.0,
) -> HeatKernelSignature:
    """HKS(x, t) = sum_i exp(-lambda_i t) phi_i(x)^2 over the full spectrum, phi mass-orthonormal (Sun et al. 2009).

    `stiffness`, `mass`: as from `laplacian`, no massless vertex. `components`: pieces of the mesh, each of which
    has one eigenvalue that is exactly 0; how far the computed ones are from 0 measures the rounding. `regularisation`
    times the identity is in the stiffness already and lifts them a little. InvalidMesh: the mesh is too large for
    the dense engine, or the error could exceed `tolerance` (relative).
    """
    size = len(mass)
    if size > DENSE_LIMIT:
        raise InvalidMesh(
            "too-large",
            f"the dense eigensolver takes up to {DENSE_LIMIT} vertices",
            f"this mesh has {size}",
            advice="simplify it first",
        )
    eigenvalues, modes = spectrum(stiffness, mass)
    zeros = eigenvalues[:components]
    lift = regularisation / float(mass.min())
    rounding = max(float(zeros[-1]) - lift, -float(zeros[0]), 0.0) * float(times.max())
    error_bound = FLOAT32_ROUNDING + rounding
    if not error_bound <= tolerance:
        raise InvalidMesh(
            "bad-spectrum",
            f"each of the {components} components has an eigenvalue 0, to a relative error of {tolerance:.1e}",
            f"the smallest are {zeros.tolist()[:4]}, the largest of all is {eigenvalues[-1]:.1e}",
            advice="pieces or faces that are too small beside the others do this: remove them",
        )
    values = np.square(modes) @ np.exp(-np.outer(eigenvalues, times))
    return HeatKernelSignature(values, size, error_bound)


def spectrum(
    stiffness: sp.csc_matrix, mass: Float64[np.ndarray, " V"]
) -> tuple[Float64[np.ndarray, " V"], Float64[np.ndarray, "V V"]]:
    """All eigenpairs of stiffness phi = lambda mass phi by dense LAPACK: eigenvalues rising, columns
    mass-orthonormal."""
    root = 1 / np.sqrt(mass)
    symmetric = root[:, None] * stiffness.toarray() * root
    eigenvalues, vectors = scipy.linalg.eigh(symmetric, driver="evd", overwrite_a=True, check_finite=False)
    return eigenvalues, root[:, None] * vectors
