"""What functional maps need of a mesh: its lowest Laplacian eigenfunctions, areas, and where a template's vertices
are."""

from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float32, Float64, Int
from torch import Tensor

from meshshard import Sample, UsageError
from meshshard_train.config import TrainConfig
from meshshard_train.tensors import OfTensors


@dataclass(frozen=True, eq=False, kw_only=True)
class Spectrum(OfTensors):
    """One mesh scaled to area 1, so that nothing here depends on its size. K eigenfunctions, M template vertices.

    `areas_V` sum to 1; `eigenfunctions_VK` are orthonormal with these weights and 0 at unreferenced vertices;
    `points_M` is the mesh's vertex at each vertex of the template, -1 where there is none.
    """

    eigenfunctions_VK: Float32[Tensor, "V K"]
    eigenvalues_K: Float64[Tensor, " K"]
    areas_V: Float32[Tensor, " V"]
    points_M: Int[Tensor, " M"]


def spectrum_of(sample: Sample, config: TrainConfig) -> Spectrum:
    """The `config.eigenfunctions` lowest of a sample that has them (see `tasks.check_task`). UsageError: the mesh has
    fewer vertices than that."""
    assert sample.eigenvalues is not None
    assert sample.eigenvectors is not None
    assert sample.correspondence is not None
    count = config.eigenfunctions
    values = sample.eigenvalues[:count]
    if np.isnan(values).any():
        raise UsageError(
            f"{sample.id} has only {np.isfinite(values).sum()} eigenfunctions, and {count} are asked for: leave the "
            "mesh out, or train with fewer: --set eigenfunctions=N"
        )
    area = float(sample.vertex_areas.sum(dtype=np.float64))
    used = np.where(sample.used_vertices, 1, 0)
    points = sample.correspondence.astype(np.int64)
    return Spectrum(
        eigenfunctions_VK=torch.tensor(sample.eigenvectors[:, :count] * np.float32(area**0.5)),
        eigenvalues_K=torch.tensor(values * area),
        areas_V=torch.tensor(sample.vertex_areas / np.float32(area)),
        points_M=torch.tensor(np.where((points >= 0) & (used[points] > 0), points, -1)),
    )
