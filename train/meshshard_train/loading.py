"""Where batches come from: meshes kept on the device, or read from the shards as they are needed."""

import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Generic, TypeVar

import torch
from torch.utils.data import DataLoader

from meshshard import Dataset, UsageError
from meshshard.errors import MeshshardError
from meshshard_train.config import TrainConfig
from meshshard_train.data import Batch, collate, packed, prepare
from meshshard_train.drawn import Prepared
from meshshard_train.inputs import input_size
from meshshard_train.members import training_numbers
from meshshard_train.pairs import partners, together

T = TypeVar("T")

START_METHODS = ("fork", "spawn", "forkserver")
Step = tuple[Sequence[int], tuple[tuple[int, int], ...]]
"""The meshes that are packed together, and for correspondence the places of each pair among them."""


@dataclass(frozen=True, kw_only=True)
class Loading:
    """How meshes get to the network; it does not change a number.

    `keep_gib`: a data set that needs no more is kept on the device, prepared; others are read from the shards in
    every epoch, by `workers` processes (0: in this one), started by `start_method` (None: Python's default).
    UsageError: there is no such method.
    """

    keep_gib: float = 4.0
    workers: int = 0
    start_method: str | None = None

    def __post_init__(self) -> None:
        if self.start_method not in (None, *START_METHODS):
            raise UsageError(f"--start-method is {', '.join(START_METHODS)}, not {self.start_method!r}")


class Meshes:
    """Batches of a data set on a device."""

    def __init__(self, dataset: Dataset, config: TrainConfig, device: torch.device, loading: Loading) -> None:
        self.dataset, self.config, self.device, self.loading = dataset, config, device, loading
        self.kept: dict[int, Prepared] = {}
        self.asked: list[tuple[Sequence[int], tuple[tuple[int, int], ...], int | None]] = []

    def batches(self, plan: Sequence[Sequence[int]], epoch: int | None) -> Iterator[Batch | None]:
        """A batch for each list of numbers, None for an empty one; with an epoch, its meshes are augmented, and for
        correspondence their partners are with them."""
        steps = self._steps(plan, epoch)
        if self._fits:
            for numbers, pairs in steps:
                meshes = [self._mesh(number) for number in numbers]
                yield collate(meshes, numbers, self.config, epoch, pairs) if meshes else None
            return
        self.asked[:] = [(*step, epoch) for step in steps]
        for batch in self._loader:
            if isinstance(batch, Exception):
                raise batch
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

    @cached_property
    def _fits(self) -> bool:
        """Whether all meshes, prepared, are within `keep_gib`."""
        entries, recipe = self.dataset.index.shards, self.dataset.recipe
        channels = input_size(self.config, len(recipe.times)) + recipe.spectrum
        size = sum(entry.vertices * (4 * channels + 9) + entry.faces * 20 for entry in entries)
        return size <= self.loading.keep_gib * 2**30

    @cached_property
    def _loader(self) -> "DataLoader[Any]":
        """Gives a batch for each entry of `asked`; its workers live as long as it does."""
        several = self.loading.workers > 0
        return DataLoader(
            _Streamed(self.dataset, self.config),  # type: ignore[arg-type]
            sampler=self.asked,
            batch_size=None,
            num_workers=self.loading.workers,
            multiprocessing_context=self.loading.start_method if several else None,
            persistent_workers=several,
            pin_memory=self.device.type == "cuda",
        )


@dataclass
class _Streamed:
    """Batches as a map-style data set of torch's. An error comes back as a value: torch would put the trace of the
    worker into its text."""

    dataset: Dataset
    config: TrainConfig

    def __getitem__(self, asked: tuple[Sequence[int], tuple[tuple[int, int], ...], int | None]) -> Any:
        numbers, pairs, epoch = asked
        try:
            meshes = [prepare(self.dataset[number], self.config) for number in numbers]
        except (MeshshardError, OSError) as error:
            return error
        return collate(meshes, numbers, self.config, epoch, pairs) if meshes else None


class Timed(Generic[T]):
    """An iterator that knows for how many seconds it was waited for."""

    def __init__(self, items: Iterable[T], seconds: float = 0.0) -> None:
        self.items, self.seconds = iter(items), seconds

    def __iter__(self) -> Iterator[T]:
        return self

    def __next__(self) -> T:
        start = time.perf_counter()
        try:
            return next(self.items)
        finally:
            self.seconds += time.perf_counter() - start
