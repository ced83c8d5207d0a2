"""All meshes of a data set to a folder of shards: plan, map, publish. Read `pipeline.py` for one mesh."""

import contextlib
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import joblib
import numpy as np
from joblib.externals.loky.process_executor import TerminatedWorkerError

from meshshard.errors import InvalidMesh, UsageError
from meshshard.files import lock_folder
from meshshard.index import Index, Rejection
from meshshard.recipe import Recipe
from meshshard_prep import staging
from meshshard_prep.datasets.layout import Entry, RawDataset
from meshshard_prep.pack import publish_dataset
from meshshard_prep.pipeline import ALGORITHM_VERSION, compute_features, compute_sample
from meshshard_prep.plan import Before, Job, key_of, make_job, printable, read_entry, stored_before

TETRAHEDRON = np.eye(4, 3), np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])

FAILED = "failed"
"""Code of a mesh that broke no rule: the program or its worker did. It is tried again by the next run."""


@dataclass(frozen=True, kw_only=True)
class Report:
    """What a run came to. `computed` of the stored samples are new; in = stored + refused + failed."""

    index: Index
    computed: int
    seconds: float

    @property
    def ok(self) -> bool:
        """Every mesh is stored."""
        return not self.index.refused and not self.index.failed


def run(
    dataset: RawDataset,
    out: Path,
    recipe: Recipe,
    *,
    jobs: int = -1,
    val_fraction: float = 0.15,
    split_seed: int = 0,
    progress: Callable[[int, int, int], None] | None = None,
) -> Report:
    """Compute what is new, keep what is not, and publish `out` in one step, index.json last.

    `jobs`: joblib's n_jobs, -1 for all cores. `progress(done, total, rejected)` is called after each computed mesh.
    A mesh that breaks a rule, or breaks its worker, is in the report; the rest is stored. UsageError: two entries
    have one id, another run holds `out`, or `out` holds another data set.
    """
    start = time.perf_counter()
    _check_ids(dataset)
    with lock_folder(out):
        staging.prepare(out)
        planned, rejected = _plan(dataset, recipe)
        before = stored_before(out)
        _check_owner(before, dataset, out)
        for name, job in planned.items():
            if refusal := before.refused.get((job.key, name, job.entry.source)):
                rejected[name] = refusal
        known = set(before.samples) | set(staging.staged(out))
        todo = [job for name, job in planned.items() if name not in rejected and job.key not in known]
        for done, outcome in enumerate(_map(todo, out, recipe, jobs), start=1):
            if outcome is not None:
                rejected[outcome.id] = outcome
            if progress:
                progress(done, len(todo), len(rejected))
        rejected |= _lost(todo, rejected, out)
        index = publish_dataset(
            out,
            dataset,
            [job for name, job in planned.items() if name not in rejected],
            before,
            recipe=recipe,
            algorithm_version=ALGORITHM_VERSION,
            val_fraction=val_fraction,
            split_seed=split_seed,
            refused=[entry for entry in rejected.values() if entry.code != FAILED],
            failed=[entry for entry in rejected.values() if entry.code == FAILED],
        )
    return Report(
        index=index,
        computed=len(todo) - sum(job.entry.id in rejected for job in todo),
        seconds=time.perf_counter() - start,
    )


def _check_ids(dataset: RawDataset) -> None:
    seen: dict[str, str] = {}
    for entry in dataset.entries:
        if entry.id in seen:
            raise UsageError(f"two meshes have the id {entry.id!r}: {seen[entry.id]} and {entry.source}")
        seen[entry.id] = entry.source


def _check_owner(before: Before, dataset: RawDataset, out: Path) -> None:
    """A folder of shards is not made into another data set: what it holds would be removed."""
    if before.index is None or not before.index.ids:
        return
    same = set(before.index.ids) & {entry.id for entry in dataset.entries}
    if before.index.dataset != dataset.name or not same:
        raise UsageError(
            f"{out} holds the data set {before.index.dataset!r} of {len(before.index.ids)} meshes, and this is "
            f"{dataset.name!r}, with {len(same)} of them; give another --out, or delete that folder first"
        )


def _plan(dataset: RawDataset, recipe: Recipe) -> tuple[dict[str, Job], dict[str, Rejection]]:
    jobs, rejected = {}, {}
    for entry in sorted(dataset.entries, key=lambda entry: entry.id):
        try:
            jobs[entry.id] = make_job(entry, recipe, ALGORITHM_VERSION)
        except InvalidMesh as error:
            rejected[entry.id] = _rejection(entry, error.code, str(error), "")
    return jobs, rejected


def _map(todo: list[Job], out: Path, recipe: Recipe, jobs: int) -> Iterator[Rejection | None]:
    """Outcomes as they come: None for a staged sample. Ends early when a worker dies."""
    if todo:
        _warm_up(recipe)
    parallel = joblib.Parallel(n_jobs=jobs, return_as="generator_unordered", batch_size=1)
    with contextlib.suppress(TerminatedWorkerError):
        yield from parallel(joblib.delayed(_compute)(job, out, recipe) for job in todo)


def _warm_up(recipe: Recipe) -> None:
    """Compile and cache what each worker would compile for itself. UsageError: the recipe suits no mesh."""
    try:
        compute_features(*TETRAHEDRON, recipe)
    except UsageError:
        raise
    except Exception:  # noqa: BLE001  whatever it is, each mesh will say it
        pass


def _compute(job: Job, out: Path, recipe: Recipe) -> Rejection | None:
    """One mesh, in a worker: its sample goes to staging, or the reason comes back."""
    entry = job.entry
    try:
        mesh, labels = read_entry(entry)
        if key_of(entry, mesh, labels, recipe, ALGORITHM_VERSION) != job.key:
            return _rejection(entry, FAILED, f"{entry.source}: the file changed while the run went on; run again", "")
        sample = compute_sample(entry, mesh, labels, recipe)
        sample = replace(sample, key=job.key, **job.names())
        staging.put(out, sample)
    except InvalidMesh as error:
        key = "" if error.code == "unreadable" else job.key  # a network comes back: the next run tries again
        return _rejection(entry, error.code, str(error), key)
    except Exception as error:  # noqa: BLE001  one bad mesh costs one mesh: it is reported and counted
        return _rejection(entry, FAILED, f"{entry.source}: {type(error).__name__}: {error}", "")
    return None


def _rejection(entry: Entry, code: str, message: str, key: str) -> Rejection:
    return Rejection(id=printable(entry.id), source=printable(entry.source), code=code, message=message, key=key)


def _lost(todo: list[Job], rejected: dict[str, Rejection], out: Path) -> dict[str, Rejection]:
    """Meshes that neither came back nor are staged: a worker died over one of them."""
    done = staging.staged(out)
    message = "a worker process died before this mesh was done; run again"
    return {
        job.entry.id: _rejection(job.entry, FAILED, f"{job.entry.source}: {message}", "")
        for job in todo
        if job.entry.id not in rejected and job.key not in done
    }
