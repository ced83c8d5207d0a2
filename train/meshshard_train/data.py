"""Samples of a shard to packed batches of tensors. Order and augmentation are pure functions of (seed, epoch)."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
import torch
from jaxtyping import Bool, Float, Float32, Int
from torch import Tensor

from meshshard import Dataset, Sample, UsageError
from meshshard_train.config import FEATURES, TrainConfig
from meshshard_train.model import BLOCKS, drop_path_factors

TURNED = ("vertices", "vertex_normals")
"""Features that turn with the mesh."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Batch:
    """Meshes packed one after the other. V vertices, F faces, B meshes, C channels, L blocks.

    `used_V`: vertices that have features; the others take no part in a mesh's mean. `labels`: (F,) for segmentation,
    (B,) for classification; -1 is not known and not learned. `drop_BL` is None in evaluation.
    """

    features_VC: Float[Tensor, "V C"]
    mesh_V: Int[Tensor, " V"]
    used_V: Bool[Tensor, " V"]
    faces_F3: Int[Tensor, "F 3"]
    mesh_F: Int[Tensor, " F"]
    labels: Int[Tensor, " n"]
    drop_BL: Float[Tensor, "B L"] | None
    numbers: tuple[int, ...]

    def to(self, device: torch.device) -> "Batch":
        """The same batch on another device."""
        values = {f.name: getattr(self, f.name) for f in fields(self)}
        moved: dict[str, Any] = {name: v.to(device) for name, v in values.items() if isinstance(v, Tensor)}
        return replace(self, **moved)


def input_size(config: TrainConfig, times: int) -> int:
    """Channels of the network's input."""
    return sum(FEATURES[name] or times for name in config.features)


def check_task(dataset: Dataset, config: TrainConfig) -> None:
    """Refuse a data set that has not what the configuration learns, by name."""
    if dataset.task != config.task:
        raise UsageError(f"{dataset.folder} is a data set for {dataset.task}, the run is for {config.task}")
    bare = [number for number in range(len(dataset)) if dataset[number].face_labels is None]
    if config.task == "segmentation" and bare:
        raise UsageError(
            f"{dataset.folder}: {dataset.ids[bare[0]]} has no face labels, and training needs them; labels of "
            'vertices become those of faces with to = "face" in the table [labels] of the data set\'s TOML file'
        )
    if "dihedral_official" in config.features and not dataset.recipe.official_dihedral:
        raise UsageError(
            f"{dataset.folder} has no dihedral_official: its recipe is {dataset.recipe.name}; "
            "run meshshard features with --recipe official"
        )


def inputs_of(
    sample: Sample, config: TrainConfig, rotation: Float32[np.ndarray, "3 3"] | None = None
) -> Float32[np.ndarray, "V C"]:
    """The network's input channels, scaled; positions and normals turned; rows of unused vertices are 0."""
    used = sample.used_vertices
    columns = []
    for name in config.features:
        values = np.asarray(getattr(sample, name), dtype=np.float32).reshape(len(used), -1)
        if name not in TURNED:
            columns.append(_scaled(values, name, used, config.scaling))
        else:
            columns.append(values if rotation is None else values @ rotation.T)
    return np.concatenate(columns, axis=1) * used[:, None]


def _scaled(values: np.ndarray, name: str, used: np.ndarray, scaling: str) -> np.ndarray:
    """Each channel brought to a common range over the used vertices. A constant channel becomes 0."""
    result = np.zeros_like(values)
    if not used.any():
        return result
    rows = values[used]
    if scaling == "log-standard":
        if name == "hks":
            rows = np.log(np.maximum(rows, 1e-30))
        centre, spread = rows.mean(axis=0), rows.std(axis=0)
    else:
        centre, spread = rows.min(axis=0), rows.max(axis=0) - rows.min(axis=0)
    # differences below float32's resolution of the value are rounding, not shape
    varies = spread > 1e-6 * np.maximum(np.abs(centre), 1e-6)
    result[used] = np.where(varies, (rows - centre) / np.where(varies, spread, 1), 0)
    return result


def epoch_order(numbers: Sequence[int], seed: int, epoch: int) -> list[int]:
    """The order of an epoch."""
    return [numbers[i] for i in np.random.default_rng((seed, epoch)).permutation(len(numbers))]


def packed(order: Sequence[int], sizes: Sequence[int], budget: int) -> Iterator[list[int]]:
    """Consecutive meshes until their vertices would exceed the budget; a larger mesh goes alone."""
    batch: list[int] = []
    vertices = 0
    for number in order:
        if batch and vertices + sizes[number] > budget:
            yield batch
            batch, vertices = [], 0
        batch.append(number)
        vertices += sizes[number]
    if batch:
        yield batch


def training_batches(dataset: Dataset, numbers: Sequence[int], config: TrainConfig, epoch: int) -> Iterator[Batch]:
    """One epoch: every mesh once, in a drawn order, turned, with drop-path factors."""
    for members in packed(epoch_order(numbers, config.seed, epoch), dataset.vertex_counts, config.batch_vertices):
        yield collate([dataset[number] for number in members], members, config, epoch)


def evaluation_batches(dataset: Dataset, numbers: Sequence[int], config: TrainConfig) -> Iterator[Batch]:
    """Every mesh once, in order, as it is."""
    for members in packed(numbers, dataset.vertex_counts, 4 * config.batch_vertices):
        yield collate([dataset[number] for number in members], members, config, None)


def collate(samples: Sequence[Sample], numbers: Sequence[int], config: TrainConfig, epoch: int | None) -> Batch:
    """Pack samples. With an epoch, each is turned and gets drop-path factors drawn from (seed, epoch, number), so
    that a mesh is treated the same whatever it is packed with."""
    features, faces, factors = [], [], []
    start = 0
    for sample, number in zip(samples, numbers, strict=True):
        if epoch is None:
            features.append(inputs_of(sample, config))
        else:
            rng = np.random.default_rng((config.seed, epoch, number))
            features.append(inputs_of(sample, config, quarter_turn(rng, config.rotation_axes)))
            factors.append(rng.random(BLOCKS, dtype=np.float32))
        faces.append(sample.faces.astype(np.int64) + start)
        start += len(sample.vertices)
    if config.task == "classification":
        labels = np.array([sample.mesh_label for sample in samples])
    else:
        labels = np.concatenate([_face_labels(sample) for sample in samples])
    vertex_counts, face_counts = [len(f) for f in features], [len(f) for f in faces]
    return Batch(
        features_VC=torch.from_numpy(np.concatenate(features)),
        mesh_V=torch.repeat_interleave(torch.tensor(vertex_counts)),
        used_V=torch.from_numpy(np.concatenate([sample.used_vertices for sample in samples])),
        faces_F3=torch.from_numpy(np.concatenate(faces)),
        mesh_F=torch.repeat_interleave(torch.tensor(face_counts)),
        labels=torch.from_numpy(labels.astype(np.int64)),
        drop_BL=drop_path_factors(torch.from_numpy(np.stack(factors)), config.drop_path) if factors else None,
        numbers=tuple(numbers),
    )


def _face_labels(sample: Sample) -> np.ndarray:
    return np.full(len(sample.faces), -1) if sample.face_labels is None else sample.face_labels


def quarter_turn(rng: np.random.Generator, axes: str) -> Float32[np.ndarray, "3 3"]:
    """A rotation by 0, 1, 2 or 3 right angles about one of `axes`, exact in float32."""
    if not axes:
        return np.eye(3, dtype=np.float32)
    axis = "xyz".index(axes[rng.integers(len(axes))])
    once = np.eye(3, dtype=np.float32)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    once[[i, i, j, j], [i, j, i, j]] = 0, -1, 1, 0
    return np.linalg.matrix_power(once, int(rng.integers(4)))
