"""A folder of shards as one sequence of samples."""

from bisect import bisect_right
from collections.abc import Mapping
from itertools import accumulate
from pathlib import Path

import numpy as np

from meshshard.cache import open_shard
from meshshard.index import Index, read_index
from meshshard.recipe import Recipe
from meshshard.remote import to_path
from meshshard.sample import Sample


class Dataset:
    """Random access to the samples of a folder. Cheap to make and to send to another process: shards are opened,
    and held against their sha256, when a sample of theirs is first asked for."""

    def __init__(self, folder: Path, index: Index) -> None:
        self.folder, self.index = folder, index
        self._shards = [open_shard(folder / entry.file, entry.sha256) for entry in index.shards]
        self._starts = list(accumulate((entry.meshes for entry in index.shards), initial=0))

    def __len__(self) -> int:
        return self._starts[-1]

    def __getitem__(self, number: int) -> Sample:
        if not 0 <= number < len(self):
            raise IndexError(f"{self.folder} holds {len(self)} meshes, number {number} was asked for")
        shard = bisect_right(self._starts, number) - 1
        return self._shards[shard][number - self._starts[shard]]

    @property
    def vertex_counts(self) -> list[int]:
        """Vertices of each sample."""
        return [int(count) for shard in self._shards for count in np.diff(shard.columns["vertex_ptr"])]

    @property
    def name(self) -> str:
        """The data set's name."""
        return self.index.dataset

    @property
    def task(self) -> str:
        """ "segmentation", "classification" or "unlabelled"."""
        return self.index.task

    @property
    def classes(self) -> tuple[str, ...]:
        """Class names; labels are indices into them."""
        return self.index.classes

    @property
    def recipe(self) -> Recipe:
        """The recipe its features were computed with."""
        return self.index.recipe

    @property
    def ids(self) -> tuple[str, ...]:
        """Names of the samples, in order."""
        return self.index.ids

    @property
    def splits(self) -> Mapping[str, tuple[int, ...]]:
        """Split name -> the numbers of its samples, as in `dataset[number]`."""
        numbers: dict[str, list[int]] = {}
        for number, split in enumerate(self.index.splits):
            numbers.setdefault(split, []).append(number)
        return {split: tuple(members) for split, members in sorted(numbers.items())}


def open_dataset(folder: str | Path) -> Dataset:
    """The samples of a folder that `meshshard features` wrote (the one that holds index.json), or of a copy of it
    behind a URL, as s3://bucket/folder: its shards are copied to this machine as they are needed.

    UsageError: there is no index. InvalidShard: the index, or later a shard, is damaged.
    """
    path = to_path(folder)
    return Dataset(path, read_index(path))
