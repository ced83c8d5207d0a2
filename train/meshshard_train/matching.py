"""How far correspondences are off: geodesic errors of the point maps that functional maps give."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
import torch
from jaxtyping import Float, Float32, Float64, Int
from scipy.spatial import cKDTree
from torch import Tensor

from meshshard import Dataset
from meshshard.geodesic import distances
from meshshard_train.device import autocast
from meshshard_train.functional_map import coefficients, functional_maps, true_map
from meshshard_train.loading import Meshes
from meshshard_train.model import TaskDrivenNet
from meshshard_train.pairs import evaluated_pairs
from meshshard_train.spectra import Spectrum, spectrum_of
from meshshard_train.team import Team

THRESHOLDS = np.linspace(0, 0.25, 51)
"""Of the error curve."""
POINTS = 500
"""Vertices of the template whose errors are measured; of more, so many are drawn, the same for every mesh and run."""


@dataclass
class GeodesicErrors:
    """Errors of points, in square roots of the surface's area: their number, sum, and how many are at most each of
    THRESHOLDS."""

    count: int = 0
    total: float = 0.0
    below: Float64[np.ndarray, " T"] = field(default_factory=lambda: np.zeros(len(THRESHOLDS)))

    def add(self, errors: Float[np.ndarray, " n"]) -> None:
        """Count the points of a pair."""
        self.count += len(errors)
        self.total += float(errors.sum(dtype=np.float64))
        self.below += np.searchsorted(np.sort(errors), THRESHOLDS, side="right")

    def merge(self, other: "GeodesicErrors") -> None:
        """Add what another has counted."""
        self.count, self.total = self.count + other.count, self.total + other.total
        self.below += other.below

    def mean(self) -> float:
        """A hundredth of the number that articles print. NaN where nothing was counted."""
        return self.total / self.count if self.count else float("nan")

    def curve(self) -> list[float]:
        """Share of the points with at most each of THRESHOLDS."""
        return (self.below / max(self.count, 1)).tolist()


def evaluate_matching(
    network: TaskDrivenNet, meshes: Meshes, numbers: Sequence[int], team: Team = Team()
) -> GeodesicErrors:
    """Errors of the maps that a network gives, over the ordered pairs of a split. The processes of a team share the
    work, and all get the result. UsageError: fewer than two meshes."""
    pairs = evaluated_pairs(numbers)
    found_KD: dict[int, Tensor] = {}
    spectra: dict[int, Spectrum] = {}
    for number, coefficients_KD, spectrum in _coefficients(network, meshes, numbers):
        found_KD[number], spectra[number] = coefficients_KD, spectrum

    def map_of(first: int, second: int) -> Tensor:
        values_K, other_values_K = spectra[first].eigenvalues_K, spectra[second].eigenvalues_K
        weight = meshes.config.map_regularisation
        return functional_maps(found_KD[first], found_KD[second], values_K, other_values_K, weight)

    return errors_of(map_of, meshes.dataset, spectra, pairs, team)


def evaluate_true_maps(meshes: Meshes, numbers: Sequence[int]) -> GeodesicErrors:
    """Errors of the maps of the known correspondence over the same pairs: what so few eigenfunctions cannot tell."""
    spectra = {number: spectrum_of(meshes.dataset[number], meshes.config) for number in numbers}
    pairs = evaluated_pairs(numbers)
    return errors_of(lambda a, b: true_map(spectra[a], spectra[b]), meshes.dataset, spectra, pairs)


def errors_of(
    map_of: Callable[[int, int], Float64[Tensor, "K K"]],
    dataset: Dataset,
    spectra: Mapping[int, Spectrum],
    pairs: Mapping[int, Sequence[int]],
    team: Team = Team(),
) -> GeodesicErrors:
    """Errors of the point maps of functional maps, by the number of the first mesh, then of the second.

    For each known vertex of the template: the distance on the first mesh between its own point there, and where that
    on the second is sent. A vertex y is sent to the x with the nearest row Phi_1(x) to (Phi_2 C)(y).
    """
    errors = GeodesicErrors()
    for first in team.share(sorted(pairs)):
        known = spectra[first].points_M.numpy(force=True)
        drawn = drawn_points(len(known))
        rows_VK = spectra[first].eigenfunctions_VK.numpy(force=True).astype(np.float64)
        candidates = np.flatnonzero(rows_VK.any(axis=1))
        tree, lengths = cKDTree(rows_VK[candidates]), _lengths(dataset, first)
        for second in pairs[first]:
            at_second = spectra[second].points_M.numpy(force=True)[drawn]
            both = np.flatnonzero((known[drawn] >= 0) & (at_second >= 0))
            sent_nK = spectra[second].eigenfunctions_VK.double() @ map_of(first, second)
            nearest = tree.query(sent_nK.numpy(force=True)[at_second[both]])[1]
            errors.add(lengths[both, candidates[nearest]])
    total, *others = team.gather(errors)
    for other in others:
        total.merge(other)
    return total


def drawn_points(count: int) -> Int[np.ndarray, " n"]:
    """The vertices of a template of so many whose errors are measured."""
    return np.sort(np.random.default_rng(0).permutation(count)[:POINTS])


@lru_cache(maxsize=64)
def _lengths(dataset: Dataset, number: int) -> Float32[np.ndarray, "n V"]:
    """Distances on a mesh, of area 1, from its points at `drawn_points`; kept from epoch to epoch. Rows of unknown
    points mean nothing."""
    sample = dataset[number]
    assert sample.correspondence is not None
    sources = np.maximum(sample.correspondence[drawn_points(len(sample.correspondence))], 0)
    area = sample.vertex_areas.sum(dtype=np.float64)
    return (distances(sample.vertices, sample.faces, sources) / np.sqrt(area)).astype(np.float32)


def _coefficients(
    network: TaskDrivenNet, meshes: Meshes, numbers: Sequence[int]
) -> Iterator[tuple[int, Float64[Tensor, "K D"], Spectrum]]:
    """Of each mesh its number, the network's coordinates in its eigenfunctions, and these."""
    network.eval()
    for batch in meshes.evaluation_batches(numbers):
        with torch.inference_mode(), autocast(meshes.config.precision, meshes.device):
            coordinates_VD = network(*batch.network_inputs)
        parts = coordinates_VD.split([len(spectrum.areas_V) for spectrum in batch.spectra])
        for number, part, spectrum in zip(batch.numbers, parts, batch.spectra, strict=True):
            yield number, coefficients(part, spectrum), spectrum
