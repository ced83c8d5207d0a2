"""Where batches come from: meshes kept on the device, or read from the shards as they are needed."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import torch
from torch.utils.data import DataLoader

from meshshard import Dataset
from meshshard_train.config import TrainConfig
from meshshard_train.data import Batch, Prepared, collate, packed, prepare
from meshshard_train.members import training_numbers
from meshshard_train.pairs import partners, together

Step = tuple[Sequence[int], tuple[tuple[int, int], ...]]
"""The meshes that are packed together, and for correspondence the places of each pair among them."""


@dataclass(frozen=True, kw_only=True)
class Loading:
    """How meshes get to the network; it does not change a number.

    `keep_gib`: a data set that needs no more is kept on the device, prepared; others are read from the shards in
    every epoch, by `workers` processes (0: in this one), started by `start_method` (fork, spawn, forkserver; None:
    Python's default).
    """

    keep_gib: float = 4.0
    workers: int = 0
    start_method: str | None = None


class Meshes:
    """Batches of a data set on a device."""

    def __init__(self, dataset: Dataset, config: TrainConfig, device: torch.device, loading: Loading) -> None:
        self.dataset, self.config, self.device, self.loading = dataset, config, device, loading
        self.kept: dict[int, Prepared] = {}

    def batches(self, plan: Sequence[Sequence[int]], epoch: int | None) -> Iterator[Batch | None]:
        """A batch for each list of numbers, None for an empty one; with an epoch, its meshes are augmented, and for
        correspondence their partners are with them."""
        steps = self._steps(plan, epoch)
        if self._fits():
            for numbers, pairs in steps:
                meshes = [self._mesh(number) for number in numbers]
                yield collate(meshes, numbers, self.config, epoch, pairs) if meshes else None
            return
        streamed = _Streamed(self.dataset, self.config, steps, epoch)
        loader: DataLoader[Any] = DataLoader(
            streamed,  # type: ignore[arg-type]
            batch_size=None,
            num_workers=min(self.loading.workers, len(plan)),
            multiprocessing_context=self.loading.start_method if self.loading.workers else None,
            pin_memory=self.device.type == "cuda",
        )
        for batch in loader:
            yield None if batch is None else batch.to(self.device)

    def evaluation_batches(self, numbers: Sequence[int]) -> Iterator[Batch]:
        """Every mesh once, in order, as it is."""
        plan = list(packed(numbers, self.dataset.vertex_counts, 4 * min(self.config.batch_vertices, 2048)))
        return (batch for batch in self.batches(plan, None) if batch is not None)

    def _steps(self, plan: Sequence[Sequence[int]], epoch: int | None) -> Sequence[Step]:
        if epoch is None or self.config.task != "correspondence":
            return [(numbers, ()) for numbers in plan]
        partner = partners(self._trained, self.config.seed, epoch)
        return [together(firsts, partner) for firsts in plan]

    @cached_property
    def _trained(self) -> Sequence[int]:
        return training_numbers(self.dataset, self.config)

    def _mesh(self, number: int) -> Prepared:
        if number not in self.kept:
            self.kept[number] = prepare(self.dataset[number], self.config).to(self.device)
        return self.kept[number]

    def _fits(self) -> bool:
        entries = self.dataset.index.shards
        channels = len(self.dataset.recipe.times) + 13 + self.dataset.recipe.spectrum
        size = sum(entry.vertices * (4 * channels + 9) + entry.faces * 20 for entry in entries)
        return size <= self.loading.keep_gib * 2**30


@dataclass
class _Streamed:
    """The batches of an epoch as a map-style data set of torch's: `loader[i]` is the i-th."""

    dataset: Dataset
    config: TrainConfig
    steps: Sequence[Step]
    epoch: int | None

    def __len__(self) -> int:
        return len(self.steps)

    def __getitem__(self, step: int) -> Batch | None:
        numbers, pairs = self.steps[step]
        meshes = [prepare(self.dataset[number], self.config) for number in numbers]
        return collate(meshes, numbers, self.config, self.epoch, pairs) if meshes else None
