"""What a folder of shards holds from earlier runs."""

import contextlib
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from meshshard.dataset import Dataset
from meshshard.errors import InvalidShard
from meshshard.files import sha256_of_file
from meshshard.index import INDEX_NAME, Index, Rejection, read_index
from meshshard.reader import Shard
from meshshard.recipe import Recipe
from meshshard_prep.jobs import ALGORITHM_VERSION, Job

SHARDS = "shard-*.h5"
"""All that `shard_name` gives."""


def shard_name(sha256: str) -> str:
    """The file of a shard whose content has that hash."""
    return f"shard-{sha256[:16]}.h5"


@dataclass(frozen=True, kw_only=True)
class Before:
    """What a folder holds already. `samples`: key -> shard and row; `places`: id -> shard and row; `refused`:
    (key, id, source) -> refusal, whose message names the file."""

    index: Index | None
    samples: dict[str, tuple[Shard, int]]
    places: dict[str, tuple[Shard, int]]
    refused: dict[tuple[str, str, str], Rejection]

    @cached_property
    def stored(self) -> frozenset[str]:
        """Ids of the index."""
        return frozenset(self.index.ids if self.index else ())

    @cached_property
    def _codes(self) -> dict[str, str]:
        return {entry.id: entry.code for entry in (*self.index.refused, *self.index.failed)} if self.index else {}

    def reason(self, job: Job, recipe: Recipe, staged: Collection[str]) -> str:
        """Why a job is to be computed; empty where it is not."""
        if job.key in self.samples or job.key in staged:
            return ""
        index, name = self.index, job.entry.id
        if index is None or name not in self.stored:
            return f"not stored before: {self._codes[name]}" if name in self._codes else "new"
        if index.recipe != recipe:
            return "another recipe"
        if index.algorithm_version != ALGORITHM_VERSION:
            return f"algorithm version {index.algorithm_version}, now {ALGORITHM_VERSION}"
        if name not in self.places:
            return "its shard is damaged or gone"
        shard, row = self.places[name]
        if shard.columns["source_sha256"][row] != job.source_sha256:
            return "mesh changed"
        return "labels changed" if job.entry.correspondence is None else "correspondence changed"


def stored_before(folder: Path) -> Before:
    """The samples and refusals of earlier runs. A damaged shard counts as none: it is made again. Where the index is
    damaged, the shards that are whole still count."""
    index: Index | None = None
    shards: Iterable[Shard] = ()
    if (folder / INDEX_NAME).exists():
        try:
            index = read_index(folder)
            shards = _whole_shards(Dataset(folder, index))
        except InvalidShard:
            shards = _found_shards(folder)
    samples: dict[str, tuple[Shard, int]] = {}
    places: dict[str, tuple[Shard, int]] = {}
    for shard in shards:
        for row, (key, name) in enumerate(
            zip(shard.columns["key"].tolist(), shard.columns["id"].tolist(), strict=True)
        ):
            samples[key] = places[name] = shard, row
    refused = {(entry.key, entry.id, entry.source): entry for entry in (index.refused if index else ()) if entry.key}
    return Before(index=index, samples=samples, places=places, refused=refused)


def _whole_shards(dataset: Dataset) -> Iterator[Shard]:
    for place in range(len(dataset.index.shards)):
        with contextlib.suppress(InvalidShard):
            yield dataset.shard(place)


def _found_shards(folder: Path) -> Iterator[Shard]:
    """Shards whose content is what their name says."""
    for path in sorted(folder.glob(SHARDS)):
        shard = Shard(path)
        with contextlib.suppress(InvalidShard, OSError):
            if path.name == shard_name(sha256_of_file(path)) and len(shard):
                yield shard
