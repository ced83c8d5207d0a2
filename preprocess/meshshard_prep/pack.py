"""Samples to shards and an index: the same samples give the same files, however they were computed."""

from collections import deque
from dataclasses import replace
from pathlib import Path

from meshshard.errors import FAILURES, UsageError
from meshshard.files import publish, sha256_of
from meshshard.index import INDEX_NAME, Index, ShardEntry
from meshshard.recipe import Recipe
from meshshard.sample import Sample
from meshshard.schema import FIELDS
from meshshard.writer import entry_of, shard_image
from meshshard_prep import staging
from meshshard_prep.before import SHARDS, Before, shard_name
from meshshard_prep.datasets.layout import RawDataset
from meshshard_prep.jobs import ALGORITHM_VERSION, Job
from meshshard_prep.plan import Plan
from meshshard_prep.splits import assign_splits
from meshshard_prep.work import Outcome

MAX_MESHES = 256
MAX_VERTICES = 500_000
OPTIONAL = tuple(f.name for f in FIELDS if not f.required)


class Packer:
    """Writes shards while samples are still computed: in the order of ids, each as soon as it is full.

    A shard holds up to MAX_MESHES and MAX_VERTICES, all with the same optional fields. Until an index names them,
    the shards do not exist for a reader. `rejected`: all meshes that are not stored; `jobs`: all that are.
    """

    def __init__(self, out: Path, plan: Plan, recipe: Recipe, classes: tuple[str, ...]) -> None:
        self._out, self._plan, self._recipe, self._classes = out, plan, recipe, classes
        self._staged = staging.staged(out)
        self._pending = set(plan.todo)
        self._waiting = deque(sorted(plan.jobs))
        self._portion: list[Sample] = []
        self._vertices = 0
        self._shards: list[ShardEntry] = []
        self.rejected = dict(plan.rejected)
        self.jobs: list[Job] = []
        stored = [plan.jobs[name] for name in self._waiting if name not in plan.rejected]
        if plan.before.index is not None and _unchanged(plan.before.index, plan.before, stored, classes):
            self.jobs, self._shards = stored, list(plan.before.index.shards)
            self._waiting.clear()

    def take(self, outcome: Outcome) -> None:
        """Note what became of a mesh, and pack those that come next and are done. UsageError: what its worker stored
        is not here."""
        self._pending.remove(outcome.id)
        if outcome.rejection is not None:
            self.rejected[outcome.id] = outcome.rejection
        elif (path := staging.path_of(self._out, outcome.staged)).is_file():
            self._staged[self._plan.jobs[outcome.id].key] = path
        else:
            raise UsageError(
                f"a worker says that it stored {outcome.id}, but {path} is not there; "
                "--out must be a folder that all workers share"
            )
        self._advance()

    def finish(self) -> tuple[ShardEntry, ...]:
        """All shards, after the last outcome."""
        self._advance()
        self._flush()
        return tuple(self._shards)

    def _advance(self) -> None:
        while self._waiting and self._waiting[0] not in self._pending:
            name = self._waiting.popleft()
            if name not in self.rejected:
                job = self._plan.jobs[name]
                self.jobs.append(job)
                self._add(replace(self._load(job), **job.names()))

    def _load(self, job: Job) -> Sample:
        if job.key in self._plan.before.samples:
            shard, row = self._plan.before.samples[job.key]
            return shard[row]
        return staging.get(self._staged[job.key])

    def _add(self, sample: Sample) -> None:
        full = len(self._portion) == MAX_MESHES or self._vertices + len(sample.vertices) > MAX_VERTICES
        if self._portion and (full or _optional(sample) != _optional(self._portion[0])):
            self._flush()
        self._portion.append(sample)
        self._vertices += len(sample.vertices)

    def _flush(self) -> None:
        if self._portion:
            self._shards.append(_write(self._out, self._portion, self._recipe, self._classes))
        self._portion, self._vertices = [], 0


def publish_dataset(
    out: Path,
    dataset: RawDataset,
    packer: Packer,
    before: Before,
    *,
    recipe: Recipe,
    val_fraction: float,
    split_seed: int,
    train_fraction: float,
) -> Index:
    """The last shards; then the index; then what it no longer names goes. Killed anywhere, the folder is the old
    data set or the new one."""
    shards = packer.finish()
    jobs, rejected = packer.jobs, sorted(packer.rejected.values(), key=lambda entry: entry.id)
    # drawn over all entries: a mesh that is refused today does not move the others between splits
    splits = assign_splits(dataset, fraction=val_fraction, seed=split_seed, train_fraction=train_fraction)
    index = Index(
        dataset=dataset.name,
        task=dataset.task,
        classes=dataset.classes,
        recipe=recipe,
        algorithm_version=ALGORITHM_VERSION,
        shards=shards,
        ids=tuple(job.entry.id for job in jobs),
        keys=tuple(job.key for job in jobs),
        splits=tuple(splits[job.entry.id] for job in jobs),
        split_seed=split_seed,
        val_fraction=float(val_fraction),
        train_fraction=float(train_fraction),
        split_rule=dataset.split_rule,
        licence=dataset.licence,
        citation=dataset.citation,
        colours=dataset.colours,
        notes=dataset.notes,
        refused=tuple(entry for entry in rejected if entry.code not in FAILURES),
        failed=tuple(entry for entry in rejected if entry.code in FAILURES),
    )
    if index != before.index:
        publish(out / INDEX_NAME, index.to_bytes())
    named = {entry.file for entry in shards}
    for path in out.glob(SHARDS):
        if path.name not in named:
            path.unlink()
    staging.clear(out)
    return index


def _unchanged(index: Index, before: Before, jobs: list[Job], classes: tuple[str, ...]) -> bool:
    """The shards hold these samples already, under these names, and no others."""
    if classes != index.classes or [job.key for job in jobs] != list(index.keys):
        return False
    if [job.entry.id for job in jobs] != list(index.ids) or any(name not in before.places for name in index.ids):
        return False
    rows = (before.places[job.entry.id] for job in jobs)
    return all(
        all(shard.columns[name][row] == value for name, value in job.names().items())
        for job, (shard, row) in zip(jobs, rows, strict=True)
    )


def _write(out: Path, samples: list[Sample], recipe: Recipe, classes: tuple[str, ...]) -> ShardEntry:
    """Publish one shard under a name made of its content; a file of that name that is whole is the same file."""
    image = shard_image(samples, recipe=recipe, algorithm_version=ALGORITHM_VERSION, classes=classes)
    digest = sha256_of(image)
    path = out / shard_name(digest)
    if not (path.is_file() and path.read_bytes() == image):
        publish(path, image)
    return entry_of(path.name, image, digest, samples)


def _optional(sample: Sample) -> list[bool]:
    return [getattr(sample, name) is None for name in OPTIONAL]
