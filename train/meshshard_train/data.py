"""Samples to packed batches of tensors. Order and augmentation are pure functions of (seed, epoch)."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Bool, Float, Float32, Int
from torch import Tensor

from meshshard import Sample
from meshshard_train.config import TrainConfig
from meshshard_train.drawn import Prepared, drawn_part
from meshshard_train.inputs import inputs_of, turned_columns
from meshshard_train.model import BLOCKS, drop_path_factors
from meshshard_train.pairs import pair_sizes
from meshshard_train.spectra import Spectrum, spectrum_of
from meshshard_train.tasks import labels_of
from meshshard_train.tensors import OfTensors


@dataclass(frozen=True, eq=False, kw_only=True)
class Batch(OfTensors):
    """Meshes packed one after the other. V vertices, F faces, B meshes, C channels, L blocks.

    `used_V`: vertices that have features; the others take no part in a mesh's mean. `areas_V`: of vertices, in the
    unit of their mesh. `labels`: of faces, vertices or meshes, as the task has it; -1 is not known and not learned.
    `drop_BL` is None in evaluation. For correspondence: `spectra` of the meshes, and `pairs` of places in `numbers`,
    none in evaluation.
    """

    features_VC: Float[Tensor, "V C"]
    mesh_V: Int[Tensor, " V"]
    used_V: Bool[Tensor, " V"]
    areas_V: Float[Tensor, " V"]
    faces_F3: Int[Tensor, "F 3"]
    mesh_F: Int[Tensor, " F"]
    labels: Int[Tensor, " n"]
    drop_BL: Float[Tensor, "B L"] | None
    numbers: tuple[int, ...]
    spectra: tuple[Spectrum, ...] = ()
    pairs: tuple[tuple[int, int], ...] = ()

    @property
    def network_inputs(self) -> tuple[Tensor | None, ...]:
        """What a network is called with, in its order."""
        return self.features_VC, self.mesh_V, self.vertex_drops, self.used_V, self.areas_V

    @property
    def vertex_drops(self) -> Float[Tensor, "V L"] | None:
        """Drop-path factors of each vertex."""
        return None if self.drop_BL is None else self.drop_BL[self.mesh_V]

    @property
    def of_losses(self) -> tuple[tuple[int, ...], ...]:
        """The numbers that each loss is of: of a mesh, or of both meshes of a pair."""
        pairs = tuple((self.numbers[first], self.numbers[second]) for first, second in self.pairs)
        return pairs or tuple((number,) for number in self.numbers)


def prepare(sample: Sample, config: TrainConfig) -> Prepared:
    """What is the same in every epoch."""
    return Prepared(
        features_VC=inputs_of(sample, config),
        used_V=torch.tensor(sample.used_vertices),
        areas_V=torch.tensor(sample.vertex_areas),
        faces_F3=torch.tensor(sample.faces),
        labels=torch.tensor(labels_of(sample, config.task), dtype=torch.int64),
        spectra=(spectrum_of(sample, config),) if config.task == "correspondence" else (),
    )


def collate(
    meshes: Sequence[Prepared],
    numbers: Sequence[int],
    config: TrainConfig,
    epoch: int | None,
    pairs: tuple[tuple[int, int], ...] = (),
) -> Batch:
    """Pack meshes, on the device they are on. With an epoch, each is turned, gets drop-path factors, and only a part
    of its vertices may be taken, all drawn from (seed, epoch, number), so that a mesh is treated the same whatever it
    is packed with."""
    device = meshes[0].features_VC.device
    rngs = [] if epoch is None else [np.random.default_rng((config.seed, epoch, number)) for number in numbers]
    turns = [quarter_turn(rng, config.rotation_axes) for rng in rngs]
    draws = [rng.random(BLOCKS, dtype=np.float32) for rng in rngs]
    if rngs and config.vertex_fraction < 1:
        meshes = [drawn_part(mesh, rng, config) for mesh, rng in zip(meshes, rngs, strict=True)]
    vertex_counts = [len(mesh.used_V) for mesh in meshes]
    starts = np.cumsum([0, *vertex_counts[:-1]]).tolist()
    mesh_V = torch.repeat_interleave(torch.tensor(vertex_counts)).to(device, non_blocking=True)
    mesh_F = torch.repeat_interleave(torch.tensor([len(mesh.faces_F3) for mesh in meshes]))
    features_VC = torch.cat([mesh.features_VC for mesh in meshes])
    drop_BL = None
    if rngs:
        turn_V33 = torch.from_numpy(np.stack(turns)).to(device)[mesh_V]
        for columns in turned_columns(config, features_VC.shape[1]):
            features_VC[:, columns] = (turn_V33 * features_VC[:, None, columns]).sum(2)
        drop_BL = drop_path_factors(torch.from_numpy(np.stack(draws)), config.drop_path).to(device)
    return Batch(
        features_VC=features_VC,
        mesh_V=mesh_V,
        used_V=torch.cat([mesh.used_V for mesh in meshes]),
        areas_V=torch.cat([mesh.areas_V for mesh in meshes]),
        faces_F3=torch.cat([mesh.faces_F3 + start for mesh, start in zip(meshes, starts, strict=True)]),
        mesh_F=mesh_F.to(device, non_blocking=True),
        labels=torch.cat([mesh.labels for mesh in meshes]),
        drop_BL=drop_BL,
        numbers=tuple(numbers),
        spectra=tuple(spectrum for mesh in meshes for spectrum in mesh.spectra),
        pairs=pairs,
    )


def epoch_order(numbers: Sequence[int], seed: int, epoch: int) -> list[int]:
    """The order of an epoch."""
    return [numbers[i] for i in np.random.default_rng((seed, epoch)).permutation(len(numbers))]


def packed(
    order: Sequence[int], sizes: Sequence[int] | Mapping[int, int], budget: int, most: int = 0
) -> Iterator[list[int]]:
    """Consecutive meshes until their vertices would exceed the budget, or `most` are together; a larger mesh goes
    alone."""
    batch: list[int] = []
    vertices = 0
    for number in order:
        if batch and (vertices + sizes[number] > budget or len(batch) == most):
            yield batch
            batch, vertices = [], 0
        batch.append(number)
        vertices += sizes[number]
    if batch:
        yield batch


def steps_of(numbers: Sequence[int], sizes: Sequence[int], config: TrainConfig, epoch: int) -> list[list[int]]:
    """The meshes of each step of one pass over them: every mesh once, in a drawn order; for correspondence with the
    vertices of its partner."""
    order, paired = epoch_order(numbers, config.seed, epoch), config.task == "correspondence"
    together = pair_sizes(numbers, sizes, config.seed, epoch) if paired else sizes
    return list(packed(order, together, config.batch_vertices, config.batch_meshes))


def quarter_turn(rng: np.random.Generator, axes: str) -> Float32[np.ndarray, "3 3"]:
    """A rotation by 0, 1, 2 or 3 right angles about one of `axes`, exact in float32."""
    if not axes:
        return np.eye(3, dtype=np.float32)
    axis = "xyz".index(axes[rng.integers(len(axes))])
    once = np.eye(3, dtype=np.float32)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    once[[i, i, j, j], [i, j, i, j]] = 0, -1, 1, 0
    return np.linalg.matrix_power(once, int(rng.integers(4)))
