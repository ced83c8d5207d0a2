"""The heat kernel signature. The one place to change for a faster engine."""

from dataclasses import dataclass

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from jaxtyping import Float64

from meshshard.errors import InvalidMesh

DENSE_LIMIT = 10_000
"""Most vertices the dense engine takes: 3 times 800 MB of matrix, minutes of time."""


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
    regularisation: float = 0.0,
) -> HeatKernelSignature:
    """HKS(x, t) = sum_i exp(-lambda_i t) phi_i(x)^2 over the full spectrum, phi mass-orthonormal (Sun et al. 2009).

    `stiffness`, `mass`: as from `laplacian`, no massless vertex. `components`: pieces of the mesh, each of which
    has one zero eigenvalue, lifted a little where `regularisation` times the identity is in the stiffness already.
    InvalidMesh where the mesh is too large for the dense engine, or where the eigenvalues
    contradict the mesh.
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
    _check(eigenvalues, components, lift=regularisation / float(mass.min()))
    values = np.square(modes) @ np.exp(-np.outer(eigenvalues, times))
    return HeatKernelSignature(values, size, _rounding_bound(eigenvalues, mass, times, values))


def spectrum(
    stiffness: sp.csc_matrix, mass: Float64[np.ndarray, " V"]
) -> tuple[Float64[np.ndarray, " V"], Float64[np.ndarray, "V V"]]:
    """All eigenpairs of stiffness phi = lambda mass phi by dense LAPACK: eigenvalues rising, columns
    mass-orthonormal."""
    root = 1 / np.sqrt(mass)
    symmetric = root[:, None] * stiffness.toarray() * root
    eigenvalues, vectors = scipy.linalg.eigh(symmetric, driver="evd", overwrite_a=True, check_finite=False)
    return eigenvalues, root[:, None] * vectors


def _check(eigenvalues: np.ndarray, components: int, lift: float) -> None:
    """Zero modes are the components and nothing is negative, up to the rounding of the largest eigenvalue."""
    rounding = max(1e-6, 1e-14 * float(eigenvalues[-1]))
    zeros = int((eigenvalues < rounding + lift).sum())
    if eigenvalues[0] < -rounding or zeros < components:
        raise InvalidMesh(
            "bad-spectrum",
            f"eigenvalues are at least 0, and 0 once for each of the {components} components (to {rounding:.1e})",
            f"the smallest are {eigenvalues[: components + 1].tolist()}",
        )


def _rounding_bound(eigenvalues: np.ndarray, mass: np.ndarray, times: np.ndarray, values: np.ndarray) -> float:
    """Largest relative error that a backward-stable eigensolver and float32 storage can leave.

    The solver's result is exact for a matrix 10 eps lambda_max away (LAPACK's p(n) is small), and exp(-tA) moves by
    at most t times that; 6e-8 is half a unit of float32.
    """
    away = 10 * np.finfo(float).eps * max(float(eigenvalues[-1]), 1.0)
    return float((away * times / (values * mass[:, None])).max()) + 6e-8
