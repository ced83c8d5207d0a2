"""Functional maps: which function on one mesh is which on another, as a small matrix between their eigenfunctions.

Ovsjanikov et al. 2012, Functional Maps; the layer that solves for a map from learned coordinates and the supervised
loss: Donati, Sharma and Ovsjanikov 2020, Deep Geometric Functional Maps. Everything is in double precision.
Shapes: P pairs, K eigenfunctions, D functional coordinates. A pair is (first, second): its map takes coefficients of
a function on the first mesh to those of the same function on the second.
"""

import torch
from jaxtyping import Float, Float64
from torch import Tensor

from meshshard_train.spectra import Spectrum


def coefficients(values_VD: Float[Tensor, "V D"], spectrum: Spectrum) -> Float64[Tensor, "K D"]:
    """Functions on a mesh in its eigenfunctions: Phi^T M f, the area-weighted projection."""
    weighted_VK = spectrum.areas_V[:, None].double() * spectrum.eigenfunctions_VK
    return weighted_VK.T @ values_VD.double()


def functional_maps(
    first_KD: Float64[Tensor, "*P K D"],
    second_KD: Float64[Tensor, "*P K D"],
    first_values_K: Float64[Tensor, "*P K"],
    second_values_K: Float64[Tensor, "*P K"],
    regularisation: float,
) -> Float64[Tensor, "*P K K"]:
    """The C that minimises |C A - B|^2 + regularisation |C diag(a) - diag(b) C|^2, for one pair or several. A and B
    are the coefficients of the coordinates, a and b the eigenvalues.

    The second term asks that C commutes with the Laplacians; it weighs each entry of a row by (a_j - b_i)^2, so every
    row i is a system of its own: (A A^T + regularisation diag((a_j - b_i)^2)) c_i = A b_i.
    """
    gram_KK = first_KD @ first_KD.mT
    right_KK = second_KD @ first_KD.mT
    gaps_KK = (first_values_K[..., None, :] - second_values_K[..., :, None]).square()
    systems_KKK = gram_KK[..., None, :, :] + regularisation * torch.diag_embed(gaps_KK)
    return torch.linalg.solve(systems_KKK, right_KK)


def true_map(first: Spectrum, second: Spectrum) -> Float64[Tensor, "K K"]:
    """The map that a known correspondence stands for: the least squares solution of Phi_2 C = Phi_1 over the vertices
    of the template, each with its share of the second mesh's area; the smallest of several."""
    known_M = (first.points_M >= 0) & (second.points_M >= 0)
    at_first, at_second = first.points_M[known_M], second.points_M[known_M]
    sharing_V = torch.bincount(at_second, minlength=len(second.areas_V))
    weights_m1 = (second.areas_V.double() / sharing_V.clamp(min=1))[at_second, None]
    first_mK = first.eigenfunctions_VK[at_first].double()
    second_mK = second.eigenfunctions_VK[at_second].double()
    gram_KK = second_mK.T @ (weights_m1 * second_mK)
    return torch.linalg.pinv(gram_KK, hermitian=True) @ (second_mK.T @ (weights_m1 * first_mK))


def map_losses(
    coordinates_VD: Float[Tensor, "V D"],
    spectra: tuple[Spectrum, ...],
    pairs: tuple[tuple[int, int], ...],
    regularisation: float,
) -> Float64[Tensor, " P"]:
    """|C - C_true|^2 / K of each pair of packed meshes; 1 or so for a map that knows nothing. `pairs`: numbers of
    `spectra`."""
    parts = coordinates_VD.split([len(spectrum.areas_V) for spectrum in spectra])
    found_BKD = torch.stack([coefficients(part, own) for part, own in zip(parts, spectra, strict=True)])
    values_BK = torch.stack([spectrum.eigenvalues_K for spectrum in spectra])
    first, second = [pair[0] for pair in pairs], [pair[1] for pair in pairs]
    maps_PKK = functional_maps(
        found_BKD[first], found_BKD[second], values_BK[first], values_BK[second], regularisation
    )
    true_PKK = torch.stack([true_map(spectra[a], spectra[b]) for a, b in pairs])
    return (maps_PKK - true_PKK).square().sum(dim=(1, 2)) / true_PKK.shape[1]
