"""How long a run would take, and how much it would store: from a few of its meshes, computed for the purpose."""

import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, fields

import numpy as np

from meshshard.errors import InvalidMesh
from meshshard.recipe import Recipe
from meshshard_prep.isolation import Limits, isolated
from meshshard_prep.jobs import Job, read_entry
from meshshard_prep.lost import Lost
from meshshard_prep.work import warm_up

TRIALS = 5
LIMITS = Limits(seconds=60.0)
"""Of one trial; a mesh that needs longer is judged by the smaller ones."""


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """`seconds` of all workers' computing, `bytes` of shards, from `trials` meshes that were computed."""

    seconds: float
    bytes: int
    trials: int


def estimate(jobs: Sequence[Job], recipe: Recipe) -> Estimate:
    """Compute up to TRIALS meshes, evenly spread over the files' sizes, and interpolate time and size a byte.

    Nothing is stored. Without a trial that succeeds, all figures are 0.
    """
    size_of = {job.entry.id: job.entry.path.stat().st_size for job in jobs}
    ordered = sorted(jobs, key=lambda job: size_of[job.entry.id])
    sizes = np.array([size_of[job.entry.id] for job in ordered])
    process = isolated(warm_up, recipe)
    trials = []
    for number in {round(position) for position in np.linspace(0, len(ordered) - 1, min(TRIALS, len(ordered)))}:
        with suppress(Lost, InvalidMesh):
            seconds, stored = process.call(measure, ordered[number], recipe, limits=LIMITS)
            trials.append((sizes[number], seconds / sizes[number], stored / sizes[number]))
    if not trials:
        return Estimate(seconds=0.0, bytes=0, trials=0)
    tried, *rates = np.array(sorted(trials)).T
    all_seconds, all_bytes = (sizes @ np.interp(sizes, tried, rate) for rate in rates)
    return Estimate(seconds=float(all_seconds), bytes=round(all_bytes), trials=len(trials))


def measure(job: Job, recipe: Recipe) -> tuple[float, int]:
    """Seconds that one mesh takes, and bytes of its sample's arrays. Runs in an isolated process."""
    from meshshard_prep.pipeline import compute_sample  # heavy

    start = time.perf_counter()
    sample = compute_sample(job.entry, *read_entry(job.entry), recipe)
    values = [getattr(sample, field.name) for field in fields(sample)]
    return time.perf_counter() - start, sum(value.nbytes for value in values if isinstance(value, np.ndarray))
