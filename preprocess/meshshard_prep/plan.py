"""What a run would do: what is stored, what is to be computed and why."""

import contextlib
from collections.abc import Collection
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from itertools import chain
from pathlib import Path

from meshshard.dataset import Dataset
from meshshard.errors import InvalidMesh, InvalidShard
from meshshard.index import INDEX_NAME, Index, Rejection, read_index
from meshshard.reader import Shard
from meshshard.recipe import Recipe
from meshshard_prep import staging
from meshshard_prep.datasets.layout import Entry, RawDataset
from meshshard_prep.jobs import ALGORITHM_VERSION, Job, make_job, rejection

READERS, PART = 8, 32
"""Threads that hash raw files, for those wait for the disk or the network; files that one takes at a time."""


@dataclass(frozen=True, kw_only=True)
class Plan:
    """What a run would do. `jobs`: every mesh that can be read, by id; `rejected`: those that cannot, and those
    refused before whose files have not changed; `todo`: id -> why it is to be computed; `gone`: ids that are stored
    and not among the raw files any more."""

    before: "Before"
    jobs: dict[str, Job]
    rejected: dict[str, Rejection]
    todo: dict[str, str]
    gone: tuple[str, ...]

    @property
    def fresh(self) -> int:
        """Meshes whose sample is stored already, or computed and waiting to be packed."""
        return len(self.jobs) - len(self.todo) - len(self.rejected.keys() & self.jobs.keys())


def make_plan(dataset: RawDataset, out: Path, recipe: Recipe) -> Plan:
    """Hash all raw files and hold them against what `out` holds. Nothing is written."""
    before = stored_before(out)
    staged = staging.staged(out)
    jobs, rejected = {}, {}
    entries = sorted(dataset.entries, key=lambda entry: entry.id)
    parts = [entries[start : start + PART] for start in range(0, len(entries), PART)]
    with ThreadPoolExecutor(READERS) as threads:
        found = threads.map(lambda part: [_job_or_rejection(entry, recipe) for entry in part], parts)
        for entry, job in zip(entries, chain.from_iterable(found), strict=True):
            if isinstance(job, Rejection):
                rejected[entry.id] = job
                continue
            jobs[entry.id] = job
            if refusal := before.refused.get((job.key, entry.id, entry.source)):
                rejected[entry.id] = refusal
    todo = {
        name: reason
        for name, job in jobs.items()
        if name not in rejected and (reason := before.reason(job, recipe, staged))
    }
    stored = before.index.ids if before.index else ()
    ids = {entry.id for entry in entries}
    gone = tuple(name for name in stored if name not in ids)
    return Plan(before=before, jobs=jobs, rejected=rejected, todo=todo, gone=gone)


def _job_or_rejection(entry: Entry, recipe: Recipe) -> Job | Rejection:
    try:
        return make_job(entry, recipe)
    except InvalidMesh as error:
        return rejection(entry, error.code, str(error), "")


@dataclass(frozen=True, kw_only=True)
class Before:
    """What a folder holds already. `samples`: key -> shard and row; `places`: id -> shard and row; `refused`:
    (key, id, source) -> refusal, whose message names the file."""

    index: Index | None
    samples: dict[str, tuple[Shard, int]]
    places: dict[str, tuple[Shard, int]]
    refused: dict[tuple[str, str, str], Rejection]

    @cached_property
    def _stored(self) -> frozenset[str]:
        return frozenset(self.index.ids if self.index else ())

    @cached_property
    def _codes(self) -> dict[str, str]:
        return {entry.id: entry.code for entry in (*self.index.refused, *self.index.failed)} if self.index else {}

    def reason(self, job: Job, recipe: Recipe, staged: Collection[str]) -> str:
        """Why a job is to be computed; empty where it is not."""
        if job.key in self.samples or job.key in staged:
            return ""
        index, name = self.index, job.entry.id
        if index is None or name not in self._stored:
            return f"not stored before: {self._codes[name]}" if name in self._codes else "new"
        if index.recipe != recipe:
            return "another recipe"
        if index.algorithm_version != ALGORITHM_VERSION:
            return f"algorithm version {index.algorithm_version}, now {ALGORITHM_VERSION}"
        if name not in self.places:
            return "its shard is damaged or gone"
        shard, row = self.places[name]
        return "mesh changed" if shard.columns["source_sha256"][row] != job.source_sha256 else "labels changed"


def stored_before(folder: Path) -> Before:
    """The samples and refusals of earlier runs. A damaged index or shard counts as none: it is made again."""
    nothing = Before(index=None, samples={}, places={}, refused={})
    if not (folder / INDEX_NAME).exists():
        return nothing
    try:
        index = read_index(folder)
    except InvalidShard:
        return nothing
    samples: dict[str, tuple[Shard, int]] = {}
    places: dict[str, tuple[Shard, int]] = {}
    start = 0
    dataset = Dataset(folder, index)
    for place, entry in enumerate(index.shards):
        with contextlib.suppress(InvalidShard):
            shard = dataset.shard(place)
            for row in range(len(shard)):
                samples[index.keys[start + row]] = places[index.ids[start + row]] = shard, row
        start += entry.meshes
    refused = {(entry.key, entry.id, entry.source): entry for entry in index.refused if entry.key}
    return Before(index=index, samples=samples, places=places, refused=refused)
