"""The heat kernel signature, without eigenvectors: diagonals of sparse inverses, summed over shared poles."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float64

from meshshard.errors import InvalidMesh, UsageError
from meshshard_prep.features.laplacian import symmetric_operator
from meshshard_prep.features.rational import RationalExponential
from meshshard_prep.features.selected_inversion import inverse_diagonals
from meshshard_prep.features.stored_poles import COUNTS, rational_exponential

FLOAT32_ROUNDING = 6e-8
"""Half a unit in the last place of a stored value."""

ROUNDING_MARGIN = 2.0
"""On rounding, for it is measured on one vector only."""

PROMISE = 0.25
"""A sum is tried when it promises this part of the tolerance: few meshes then need a longer one."""


@dataclass(frozen=True, eq=False)
class HeatKernelSignature:
    """`values` (V,T), the number of poles they were summed over, and the bound of their relative error."""

    values: Float64[np.ndarray, "V T"]
    poles: int
    error_bound: float


def heat_kernel_signature(
    stiffness: sp.csc_matrix,
    mass: Float64[np.ndarray, " V"],
    times: tuple[float, ...],
    *,
    tolerance: float = 1e-5,
) -> HeatKernelSignature:
    """HKS(x, t) = sum_i exp(-lambda_i t) phi_i(x)^2 over the full spectrum, phi mass-orthonormal (Sun et al. 2009).

    `stiffness`, `mass`: as from `laplacian`, no massless vertex. With A = M^-1/2 L M^-1/2 this is diag(exp(-t A)) / M
    and exp(-t A) is a short sum of inverses of A - p I. The bound is that of the sum at this mesh, plus rounding as
    measured, plus that of storing float32. InvalidMesh: it exceeds `tolerance` even with the most poles. UsageError:
    it would on any mesh.
    """
    operator, root = symmetric_operator(stiffness, mass)
    image = (stiffness @ np.ones(len(mass))) / root
    bounds = []
    for count in COUNTS:
        approximation = rational_exponential(times, count)
        if approximation.error > PROMISE * tolerance and count < COUNTS[-1]:
            continue
        if approximation.error > tolerance and count == COUNTS[-1]:
            raise UsageError(
                f"{COUNTS[-1]} poles reach a relative error of {approximation.error:.1e} for times from {min(times)} "
                f"to {max(times)}, and the recipe's hks_tolerance is {tolerance:.1e}: raise it, or take times that "
                "are closer together"
            )
        kernel, error = heat_kernel_diagonal(operator, approximation, root, image)
        bounds.append(FLOAT32_ROUNDING + _largest_ratio(error, kernel - error))
        if bounds[-1] <= tolerance:
            return HeatKernelSignature(kernel / mass[:, None], count, bounds[-1])
    raise InvalidMesh(
        "inexact-hks",
        f"the relative error of the HKS is at most {tolerance:.1e}",
        f"its bound is {' then '.join(f'{bound:.1e}' for bound in bounds)} with up to {COUNTS[-1]} poles",
        advice="remove pieces or faces that are too small beside the others, or raise the recipe's hks_tolerance",
    )


def heat_kernel_diagonal(
    operator: sp.csc_matrix,
    approximation: RationalExponential,
    ground: Float64[np.ndarray, " V"],
    image: Float64[np.ndarray, " V"],
) -> tuple[Float64[np.ndarray, "V T"], Float64[np.ndarray, "V T"]]:
    """diag(exp(-t A)) at every time, and a bound of its absolute error: the sum's, and rounding.

    Rounding is measured on the positive vector `ground`, of which A makes `image`.
    """
    diagonals, rounding = inverse_diagonals(operator, approximation.poles, ground, image)
    kernel = (diagonals @ approximation.weights.T).real
    error = diagonals.imag @ approximation.majorants.T
    error += (np.abs(diagonals) * (ROUNDING_MARGIN * rounding)) @ np.abs(approximation.weights).T
    return kernel, error


def _largest_ratio(error: Float64[np.ndarray, "V T"], least: Float64[np.ndarray, "V T"]) -> float:
    """Largest error / value, where the value may be as small as `least`; infinite where that is not positive."""
    ratio = np.divide(error, least, out=np.full_like(error, np.inf), where=least > 0)
    return float(ratio.max())
