"""What a run would do: what is stored, what is to be computed and why."""

import json
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from threading import Event

from meshshard.errors import InvalidMesh, UsageError
from meshshard.index import Rejection
from meshshard.recipe import Recipe
from meshshard_prep import staging
from meshshard_prep.before import Before, stored_before
from meshshard_prep.correspondence import check_vertices_stay
from meshshard_prep.datasets.layout import Entry, RawDataset
from meshshard_prep.jobs import Job, make_job, rejection
from meshshard_prep.labels import MOST_CLASSES

MOST_BYTES_OF_CLASSES = 60_000
"""HDF5 keeps attributes of up to 64 KB where every reader looks."""

READERS, PART = 8, 32
"""Threads that hash raw files, for those wait for the disk or the network; files that one takes at a time."""


@dataclass(frozen=True, kw_only=True)
class Plan:
    """What a run would do. `jobs`: every mesh that can be read, by id; `rejected`: those that cannot, and those
    refused before whose files have not changed; `todo`: id -> why it is to be computed; `gone`: ids that are stored
    and not among the raw files any more."""

    before: Before
    jobs: dict[str, Job]
    rejected: dict[str, Rejection]
    todo: dict[str, str]
    gone: tuple[str, ...]

    @property
    def fresh(self) -> int:
        """Meshes whose sample is stored already, or computed and waiting to be packed."""
        return len(self.jobs) - len(self.todo) - len(self.rejected.keys() & self.jobs.keys())


def make_plan(dataset: RawDataset, out: Path, recipe: Recipe) -> Plan:
    """Hash all raw files and hold them against what `out` holds. Nothing is written. UsageError: two entries have one
    id, the recipe takes away vertices that the data set names, or `out` holds another data set."""
    _check_ids(dataset)
    _check_classes(dataset)
    check_vertices_stay(dataset, recipe)
    before = stored_before(out)
    _check_owner(before, dataset, out)
    staged = staging.staged(out)
    jobs, rejected = {}, {}
    entries = sorted(dataset.entries, key=lambda entry: entry.id)
    for entry, job in zip(entries, _jobs_or_rejections(entries, recipe), strict=True):
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
    gone = tuple(sorted(before.stored - {entry.id for entry in entries}))
    return Plan(before=before, jobs=jobs, rejected=rejected, todo=todo, gone=gone)


def _jobs_or_rejections(entries: list[Entry], recipe: Recipe) -> Iterator[Job | Rejection]:
    """In order. Left early, as by Ctrl-C, it waits for no more than the files that are being read."""
    stop = Event()

    def read(part: list[Entry]) -> list[Job | Rejection]:
        return [_job_or_rejection(entry, recipe) for entry in part if not stop.is_set()]

    with ThreadPoolExecutor(READERS) as threads:
        try:
            yield from chain.from_iterable(
                threads.map(read, (entries[start : start + PART] for start in range(0, len(entries), PART)))
            )
        finally:
            stop.set()


def _job_or_rejection(entry: Entry, recipe: Recipe) -> Job | Rejection:
    try:
        return make_job(entry, recipe)
    except InvalidMesh as error:
        return rejection(entry, error.code, str(error), "")


def _check_ids(dataset: RawDataset) -> None:
    """UsageError: two entries have one id."""
    seen: dict[str, str] = {}
    for entry in dataset.entries:
        if entry.id in seen:
            raise UsageError(f"two meshes have the id {entry.id!r}: {seen[entry.id]} and {entry.source}")
        seen[entry.id] = entry.source


def _check_classes(dataset: RawDataset) -> None:
    """UsageError: more classes than labels can count, or longer names than a shard can hold."""
    written = len(json.dumps(dataset.classes))
    if len(dataset.classes) > MOST_CLASSES or written > MOST_BYTES_OF_CLASSES:
        raise UsageError(
            f"{dataset.name!r} has {len(dataset.classes)} classes, which take {written} bytes; a data set has at "
            f"most {MOST_CLASSES} classes in {MOST_BYTES_OF_CLASSES} bytes: shorten their names, or look whether "
            "these are classes at all"
        )


def _check_owner(before: Before, dataset: RawDataset, out: Path) -> None:
    """A folder of shards is not made into another data set: what it holds would be removed."""
    if not before.places:
        return
    same = before.places.keys() & {entry.id for entry in dataset.entries}
    if not same or (before.index and before.index.dataset != dataset.name):
        name = before.index.dataset if before.index else "of a damaged index"
        raise UsageError(
            f"{out} holds the data set {name!r} of {len(before.places)} meshes, and this is "
            f"{dataset.name!r}, with {len(same)} of them; give another --out, or delete that folder first"
        )
    if before.index and before.index.task not in ("unlabelled", dataset.task):
        raise UsageError(
            f"{out} holds {dataset.name!r} for {before.index.task}, and this would make it {dataset.task}; name what "
            f"it was made from, {dataset.name}.toml say, or give another --out"
        )
