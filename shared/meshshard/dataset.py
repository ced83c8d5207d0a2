"""A folder of shards as one sequence of samples."""

from bisect import bisect_right
from collections.abc import Mapping
from itertools import accumulate
from pathlib import Path
from typing import Any

import numpy as np

from meshshard.cache import local_copy
from meshshard.errors import InvalidShard
from meshshard.index import Index, read_index
from meshshard.reader import Shard
from meshshard.recipe import Recipe
from meshshard.remote import to_path
from meshshard.sample import Sample


class Dataset:
    """Random access to the samples of a folder. Cheap to make and to send to another process: a shard is opened,
    and held against the index, when a sample of it is first asked for, in every process."""

    def __init__(self, folder: Path, index: Index) -> None:
        self.folder, self.index = folder, index
        self._starts = list(accumulate((entry.meshes for entry in index.shards), initial=0))
        self._shards: list[Shard | None] = [None] * len(index.shards)

    def __reduce__(self) -> tuple[Any, ...]:
        return Dataset, (self.folder, self.index)

    def __len__(self) -> int:
        return self._starts[-1]

    def __getitem__(self, number: int) -> Sample:
        """InvalidShard: the shard is damaged, or not the one that the index describes."""
        if not 0 <= number < len(self):
            raise IndexError(f"{self.folder} holds {len(self)} meshes, number {number} was asked for")
        place = bisect_right(self._starts, number) - 1
        return self.shard(place)[number - self._starts[place]]

    def shard(self, place: int) -> Shard:
        """A shard by its place in the index, held against the index when it is first asked for. InvalidShard: it is
        damaged, or not the one that the index describes."""
        shard = self._shards[place]
        if shard is None:
            shard = self._shards[place] = self._first_touch(place)
        return shard

    def _first_touch(self, place: int) -> Shard:
        entry, start = self.index.shards[place], self._starts[place]
        shard = Shard(local_copy(self.folder / entry.file, entry.sha256), entry.sha256)
        columns = shard.columns
        pairs = {
            "ids": (tuple(columns["id"].tolist()), self.index.ids[start : start + entry.meshes]),
            "keys": (tuple(columns["key"].tolist()), self.index.keys[start : start + entry.meshes]),
            "vertex counts": (tuple(np.diff(columns["vertex_ptr"]).tolist()), entry.vertex_counts),
            "faces": (len(columns["faces"]), entry.faces),
            "classes": (shard.classes, self.index.classes),
            "recipe": (shard.recipe, self.index.recipe),
        }
        for what, (found, promised) in pairs.items():
            if found != promised:
                raise InvalidShard(
                    f"{shard.path}: its {what} are {str(found)[:80]}, the index says {str(promised)[:80]}"
                )
        return shard

    @property
    def vertex_counts(self) -> list[int]:
        """Vertices of each sample."""
        return [count for entry in self.index.shards for count in entry.vertex_counts]

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
