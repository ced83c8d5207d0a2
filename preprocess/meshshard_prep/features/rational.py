"""exp(-t x) for all times of a recipe as one short rational sum over shared poles, with a majorant of its error.

exp(-t x) = Re sum_j weights[t, j] / (x - poles[j]) for all x >= 0, up to an error that is never above
Im sum_j majorants[t, j] / (x - poles[j]). So whoever has the diagonals of (A - poles[j] I)^-1 has the diagonals of
exp(-t A) and, from the same numbers, a bound of their error that falls off where exp(-t x) does: it stays sharp for
any number of vertices and any areas, where the uniform error would have to be divided by the area of a vertex.
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg
import scipy.optimize
from jaxtyping import Complex128, Float64
from threadpoolctl import threadpool_limits

SAMPLES = 1500
"""Of the half-line, over thirteen decades. The search for poles takes a fifth of them, and of the rounds."""

REWEIGHTINGS = 20
EVALUATIONS = 120
DECAY = 0.5
MARGIN = 1.01
"""On the majorant, for what lies between the samples."""


@dataclass(frozen=True, eq=False)
class RationalExponential:
    """`poles` (P,), all above the real axis, `weights` (T,P), `majorants` (T,P) >= 0, and two errors.

    `uniform_error` is the largest |exp(-t x) - sum| over x >= 0 and all times. `error` is the relative error of the
    HKS of a smooth surface that the majorants promise, with eigenvalues evenly spread (Weyl's law) or one alone at 0.
    """

    poles: Complex128[np.ndarray, " P"]
    weights: Complex128[np.ndarray, "T P"]
    majorants: Float64[np.ndarray, "T P"]
    uniform_error: float
    error: float


def fit_exponential(times: Float64[np.ndarray, " T"], count: int) -> RationalExponential:
    """The sum with `count` poles, computed from nothing: seconds. See `stored_poles.rational_exponential`.

    The poles lie on the hyperbola of the three parameters that promise the least error, found by Nelder and Mead's
    method; the weights are then fitted anew. On one BLAS thread: with matrices so small, several are slower.
    """
    ratio = times.max() / times.min()
    some = np.geomspace(times.min(), times.max(), 3)

    def log_error(parameters: np.ndarray) -> float:
        log_size, angle, log_step = parameters
        poles = poles_on_hyperbola(count, log_size, angle, log_step, times.max())
        return float(np.log(fit_weights(some, poles, SAMPLES // 5, REWEIGHTINGS // 5).error))

    start = np.array([2.0, 0.5, np.log((2 + 0.9 * np.log(ratio)) / count)])
    with threadpool_limits(1, "blas"):
        best = scipy.optimize.minimize(log_error, start, method="Nelder-Mead", options={"maxfev": EVALUATIONS})
        log_size, angle, log_step = best.x
        return fit_weights(times, poles_on_hyperbola(count, log_size, angle, log_step, times.max()))


def poles_on_hyperbola(
    count: int, log_size: float, angle: float, log_step: float, longest: float
) -> Complex128[np.ndarray, " P"]:
    """-mu (1 + sin(i u - angle)) at u = step / 2, 3 step / 2, ..., with mu = exp(log_size) / longest.

    The contours on which inverse Laplace transforms are computed for a range of times: López-Fernández and Palencia
    2004, Weideman and Trefethen 2007. The other half of each pair, u < 0, is its conjugate.
    """
    u = np.exp(log_step) * (np.arange(count) + 0.5)
    poles = -np.exp(log_size) / longest * (1 + np.sin(1j * u - angle))
    return poles.real + 1j * np.abs(poles.imag)


def fit_weights(
    times: Float64[np.ndarray, " T"],
    poles: Complex128[np.ndarray, " P"],
    samples: int = SAMPLES,
    rounds: int = REWEIGHTINGS,
) -> RationalExponential:
    """Weights for given poles: least squares, reweighted towards the least maximum of |error| / majorant.

    The majorant of a time is fixed but for its size: a sum of Im 1 / (x - pole), none negative for x >= 0, that falls
    like 1 / (1 + t x)^DECAY among the poles and like 1 / x^2 beyond. So does the error, for the weights sum to 0.
    """
    x = np.append(0.0, np.geomspace(1e-3 / times.max(), 1e7 / times.min(), samples))
    cauchy = 1 / (x[:, None] - poles)
    columns = np.concatenate([cauchy.real, -cauchy.imag], axis=1)
    vanishing = scipy.linalg.null_space(np.append(np.ones(len(poles)), np.zeros(len(poles)))[None])
    columns = columns @ vanishing
    weights = np.empty((len(times), len(poles)), dtype=complex)
    majorants = np.empty(weights.shape)
    uniform_error = error = 0.0
    for row, time in enumerate(times):
        shape = np.abs(poles) * (1 + time * np.abs(poles)) ** -DECAY
        unit = 1 / (cauchy.imag @ shape)
        target = np.exp(-time * x)
        solution = _least_maximum(columns * unit[:, None], target * unit, rounds)
        parts = vanishing @ solution
        weights[row] = parts[: len(poles)] + 1j * parts[len(poles) :]
        absolute = np.abs((cauchy @ weights[row]).real - target)
        majorants[row] = MARGIN * (absolute * unit).max() * shape
        integral = majorants[row] @ (np.pi / 2 + np.arctan2(poles.real, poles.imag))
        at_zero = float(majorants[row] @ (poles.imag / np.abs(poles) ** 2))
        uniform_error = max(uniform_error, float(absolute.max()))
        error = max(error, time * float(integral), at_zero)
    return RationalExponential(poles, weights, majorants, uniform_error, error)


def _least_maximum(
    columns: Float64[np.ndarray, "X C"], target: Float64[np.ndarray, " X"], rounds: int
) -> Float64[np.ndarray, " C"]:
    """Coefficients with a small largest |columns @ c - target|: least squares, reweighted (Lawson 1961)."""
    scale = np.linalg.norm(columns, axis=0)
    emphasis = np.ones(len(target))
    best, least = np.zeros(len(scale)), np.inf
    for _ in range(rounds):
        found = np.linalg.lstsq(columns / scale * emphasis[:, None], target * emphasis, rcond=1e-16)[0] / scale
        residual = np.abs(columns @ found - target)
        if residual.max() < least:
            best, least = found, residual.max()
        emphasis = emphasis * np.sqrt(residual / residual.max() + 1e-3)
        emphasis /= emphasis.max()
    return best
