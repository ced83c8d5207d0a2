"""The lowest eigenpairs of a Laplacian, for tools that want them. The heat kernel signature needs none."""

from dataclasses import dataclass

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from jaxtyping import Float64
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import ArpackError, LinearOperator, eigsh, splu

from meshshard.errors import InvalidMesh
from meshshard_prep.features.components import members_of
from meshshard_prep.features.laplacian import symmetric_operator
from meshshard_prep.features.selected_inversion import count_below

TOLERANCE = 1e-6
"""Largest residual |A v - lambda v| / max(1, lambda), and relative gap under which eigenvalues count as equal."""

DENSE_SIZE = 500
"""Up to this many vertices a piece's whole spectrum is computed by LAPACK: it is as fast."""

BEYOND = 8
"""Eigenpairs computed beyond those asked for, to see where a cluster ends."""

SHIFT = -0.01
"""Below the spectrum, which begins at 0: the shifted matrix is positive definite."""


@dataclass(frozen=True, eq=False)
class Spectrum:
    """`values` (K,) rising, `modes` (V,K) mass-orthonormal, and whether the last cluster of equal values is cut."""

    values: Float64[np.ndarray, " K"]
    modes: Float64[np.ndarray, "V K"]
    cut: bool


def lowest_eigenpairs(stiffness: sp.csc_matrix, mass: Float64[np.ndarray, " V"], count: int) -> Spectrum:
    """The `count` lowest pairs of stiffness phi = lambda mass phi; all V of them where the mesh has fewer.

    Pieces are solved one by one, so that each brings its zero. Reproducible: fixed start vectors, and the largest
    entry of a mode is positive. Inside a cluster of equal eigenvalues any basis is as good as the one returned.
    InvalidMesh: a residual exceeds TOLERANCE, or by Sylvester's law of inertia some eigenvalue was missed.
    """
    operator, root = symmetric_operator(stiffness, mass)
    members = members_of(connected_components(operator, directed=False)[1])
    found = [_of_piece(operator[piece][:, piece], count + BEYOND) for piece in members]
    values = np.concatenate([own for own, _ in found])
    piece_of = np.repeat(np.arange(len(found)), [len(own) for own, _ in found])
    number = np.concatenate([np.arange(len(own)) for own, _ in found])
    order = np.argsort(values, kind="stable")[: count + BEYOND]
    values, vectors = values[order], np.zeros((len(mass), len(order)))
    for column, (piece, own) in enumerate(zip(piece_of[order], number[order], strict=True)):
        vectors[members[piece], column] = found[piece][1][:, own]
    _check(operator, values, vectors)
    cut = len(values) > count and values[count] - values[count - 1] <= TOLERANCE * max(1.0, values[count])
    modes = vectors[:, :count] / root[:, None]
    return Spectrum(values[:count], modes * _signs(modes), bool(cut))


def _of_piece(operator: sp.csc_matrix, count: int) -> tuple[Float64[np.ndarray, " K"], Float64[np.ndarray, "V K"]]:
    size = operator.shape[0]
    if size <= max(DENSE_SIZE, 3 * count):
        last = min(count, size) - 1
        values, vectors = scipy.linalg.eigh(operator.toarray(), subset_by_index=(0, last), check_finite=False)
        return values, vectors
    symmetric = {"SymmetricMode": True}
    shifted = sp.csc_matrix(operator - SHIFT * sp.eye_array(size))
    factor = splu(shifted, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=symmetric)
    inverse = LinearOperator(operator.shape, matvec=factor.solve, dtype=np.float64)
    start = np.random.default_rng(0).standard_normal(size)
    try:
        values, vectors = eigsh(operator, count, sigma=SHIFT, OPinv=inverse, v0=start)
    except ArpackError as error:
        raise _bad(f"{count} eigenpairs converge", str(error)) from error
    order = np.argsort(values)
    return values[order], vectors[:, order]


def _check(operator: sp.csc_matrix, values: Float64[np.ndarray, " K"], vectors: Float64[np.ndarray, "V K"]) -> None:
    residual = np.linalg.norm(operator @ vectors - vectors * values, axis=0) / np.maximum(1.0, values)
    if not residual.max() <= TOLERANCE:
        raise _bad(f"eigenpairs have a residual of at most {TOLERANCE:.0e}", f"one of them has {residual.max():.1e}")
    if len(values) < operator.shape[0]:
        gaps = np.diff(values)
        widest = max(len(gaps) - BEYOND, 0) + int(np.argmax(gaps[-BEYOND:]))
        between = (values[widest] + values[widest + 1]) / 2
        if gaps[widest] <= TOLERANCE * max(1.0, between):  # all of them are one cluster, and it goes on
            widest, between = len(values) - 1, values[-1] + TOLERANCE * max(1.0, values[-1])
        below = count_below(operator, between)
        if below < widest + 1 or (below > widest + 1 and widest < len(gaps)):
            raise _bad(f"{below} eigenvalues lie below {between:.6g} (inertia)", f"{widest + 1} were found")


def _bad(rule: str, found: str) -> InvalidMesh:
    return InvalidMesh("bad-spectrum", rule, found, advice="ask for another number of eigenpairs, or for none")


def _signs(modes: Float64[np.ndarray, "V K"]) -> Float64[np.ndarray, " K"]:
    """+1 or -1 for each mode, so that its largest entry, the first of equal ones, becomes positive."""
    size = np.abs(modes)
    first = np.argmax(size >= (1 - TOLERANCE) * size.max(axis=0), axis=0)
    return np.sign(modes[first, np.arange(modes.shape[1])])
