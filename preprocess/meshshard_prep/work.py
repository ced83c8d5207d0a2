"""One mesh of a run: computed in a process of its own, staged, or given up with the reason."""

import contextlib
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from meshshard.errors import InvalidMesh, UsageError
from meshshard.files import sha256_of
from meshshard.index import Rejection
from meshshard.recipe import Recipe
from meshshard.sample import Sample
from meshshard_prep import staging
from meshshard_prep.ground import Ground, check_ground
from meshshard_prep.isolation import Limits, isolated
from meshshard_prep.jobs import Job, key_of, read_entry, rejection
from meshshard_prep.lost import Lost

TETRAHEDRON = np.eye(4, 3), np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """What became of one mesh: `staged` under that name, or rejected. `seconds`: what computing it took, without any
    waiting."""

    id: str
    seconds: float
    staged: str = ""
    rejection: Rejection | None = None


@dataclass(frozen=True, kw_only=True)
class Task:
    """What a worker does with each job, wherever the worker runs. `compute` runs in the process of its own; it can
    be another module's function, as in tests of faults."""

    out: Path
    recipe: Recipe
    limits: Limits
    compute: Callable[[Job, Path, Recipe], Outcome]
    ground: Ground

    def __call__(self, job: Job) -> Outcome:
        """Compute one mesh. Where the process died it is tried once more, in a new one: what killed the first, such
        as the system being out of memory, may not have been this mesh. UsageError: the machine is at fault, or this
        worker differs from the run."""
        check_ground(self.ground)
        start = time.perf_counter()
        process = isolated(warm_up, self.recipe)
        for last_try in (False, True):
            try:
                return process.call(self.compute, job, self.out, self.recipe, limits=self.limits)
            except Lost as lost:
                died = lost.code in ("crashed", "killed")
                if last_try or not died:
                    cause = f"{lost.cause}, twice" if died else lost.cause
                    message = f"{job.entry.source}: {cause} [{lost.code}]"
                    refusal = rejection(job.entry, lost.code, message, "")
                    break
        return Outcome(id=job.entry.id, seconds=time.perf_counter() - start, rejection=refusal)


def compute(job: Job, out: Path, recipe: Recipe) -> Outcome:
    """Stage the sample of one mesh, or say which rule it breaks."""
    from meshshard_prep.pipeline import compute_sample  # only the processes that compute load scipy and libigl

    start = time.perf_counter()
    staged, refusal = "", None
    try:
        contents = read_entry(job.entry)
        hashes = [None if data is None else sha256_of(data) for data in contents]
        if key_of(job.entry, hashes, recipe) != job.key:
            message = f"{job.entry.source}: the file changed while the run went on; run again [changed]"
            refusal = rejection(job.entry, "changed", message, "")
        else:
            sample = compute_sample(job.entry, *contents, recipe)
            staged = _put(out, replace(sample, key=job.key, **job.names()))
    except InvalidMesh as error:
        key = "" if error.code == "unreadable" else job.key  # a network comes back: the next run tries again
        refusal = rejection(job.entry, error.code, str(error), key)
    return Outcome(id=job.entry.id, seconds=time.perf_counter() - start, staged=staged, rejection=refusal)


def _put(out: Path, sample: Sample) -> str:
    try:
        return staging.put(out, sample)
    except OSError as error:  # no fault of the mesh
        raise UsageError(
            f"{out} cannot be written to: {error.strerror}; what is done is kept: mend that, and the same command "
            "goes on from there"
        ) from error


def warm_up(recipe: Recipe) -> None:
    """Load, and where needed compile, what meshes of a recipe need, so that no mesh's time limit pays for it.
    UsageError: the recipe suits no mesh."""
    from meshshard_prep.pipeline import compute_features
    from meshshard_prep.prepare import simplify

    if recipe.simplify:
        simplify.warm_up()
    with contextlib.suppress(InvalidMesh):  # too coarse for this recipe, perhaps; everything is loaded
        compute_features(*TETRAHEDRON, recipe)
