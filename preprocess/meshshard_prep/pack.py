"""Samples to shards and an index: the same samples give the same files, however they were computed."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

from meshshard.files import publish, sha256_of
from meshshard.index import INDEX_NAME, Index, Rejection, ShardEntry
from meshshard.recipe import Recipe
from meshshard.sample import Sample
from meshshard.schema import FIELDS
from meshshard.writer import shard_image
from meshshard_prep import staging
from meshshard_prep.datasets.layout import RawDataset
from meshshard_prep.plan import Before, Job
from meshshard_prep.splits import assign_splits

MAX_MESHES = 256
MAX_VERTICES = 500_000
OPTIONAL = tuple(f.name for f in FIELDS if not f.required)


def publish_dataset(
    out: Path,
    dataset: RawDataset,
    jobs: list[Job],
    before: Before,
    *,
    recipe: Recipe,
    algorithm_version: int,
    val_fraction: float,
    split_seed: int,
    refused: list[Rejection],
    failed: list[Rejection],
) -> Index:
    """Shards of all `jobs`, whose samples are staged or stored before; then the index; then what it no longer names
    goes. Killed anywhere, the folder is the old data set or the new one."""
    jobs = sorted(jobs, key=lambda job: job.entry.id)
    if _unchanged(dataset, jobs, before) and before.index is not None:
        shards = before.index.shards
    else:
        waiting = staging.staged(out)

        def load(job: Job) -> Sample:
            if job.key in before.samples:
                shard, row = before.samples[job.key]
                return replace(shard[row], **job.names())
            return replace(staging.get(waiting[job.key]), **job.names())

        shards = tuple(
            _write(out, samples, recipe, algorithm_version, dataset.classes) for samples in _portions(jobs, load)
        )
    # drawn over all entries: a mesh that is refused today does not move the others between splits
    splits = assign_splits(dataset.entries, fraction=val_fraction, seed=split_seed)
    index = Index(
        dataset=dataset.name,
        task=dataset.task,
        classes=dataset.classes,
        recipe=recipe,
        algorithm_version=algorithm_version,
        shards=shards,
        ids=tuple(job.entry.id for job in jobs),
        keys=tuple(job.key for job in jobs),
        splits=tuple(splits[job.entry.id] for job in jobs),
        split_seed=split_seed,
        val_fraction=val_fraction,
        refused=tuple(sorted(refused, key=lambda entry: entry.id)),
        failed=tuple(sorted(failed, key=lambda entry: entry.id)),
    )
    if index != before.index:
        publish(out / INDEX_NAME, index.to_bytes())
    named = {entry.file for entry in shards}
    for path in out.glob("shard-*.h5"):
        if path.name not in named:
            path.unlink()
    staging.clear(out)
    return index


def _unchanged(dataset: RawDataset, jobs: list[Job], before: Before) -> bool:
    """The shards hold these samples already, under these names."""
    if before.index is None or dataset.classes != before.index.classes:
        return False
    if [job.key for job in jobs] != list(before.index.keys) or any(job.key not in before.samples for job in jobs):
        return False
    rows = (before.samples[job.key] for job in jobs)
    return all(
        all(shard.columns[name][row] == value for name, value in job.names().items())
        for job, (shard, row) in zip(jobs, rows, strict=True)
    )


def _write(
    out: Path, samples: list[Sample], recipe: Recipe, algorithm_version: int, classes: tuple[str, ...]
) -> ShardEntry:
    """Publish one shard under a name made of its content; a file of that name that is whole is the same file."""
    image = shard_image(samples, recipe=recipe, algorithm_version=algorithm_version, classes=classes)
    digest = sha256_of(image)
    path = out / f"shard-{digest[:16]}.h5"
    if not (path.is_file() and path.read_bytes() == image):
        publish(path, image)
    return ShardEntry(
        file=path.name,
        bytes=len(image),
        sha256=digest,
        vertex_counts=tuple(len(s.vertices) for s in samples),
        faces=sum(len(s.faces) for s in samples),
    )


def _portions(jobs: list[Job], load: Callable[[Job], Sample]) -> Iterator[list[Sample]]:
    """Samples in the order of their ids, up to MAX_MESHES and MAX_VERTICES each, with the same optional fields."""
    portion: list[Sample] = []
    vertices = 0
    for job in jobs:
        sample = load(job)
        full = len(portion) == MAX_MESHES or vertices + len(sample.vertices) > MAX_VERTICES
        if portion and (full or _optional(sample) != _optional(portion[0])):
            yield portion
            portion, vertices = [], 0
        portion.append(sample)
        vertices += len(sample.vertices)
    if portion:
        yield portion


def _optional(sample: Sample) -> list[bool]:
    return [getattr(sample, name) is None for name in OPTIONAL]
