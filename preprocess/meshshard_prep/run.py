"""All meshes of a data set to a folder of shards: plan, map, publish. Read `pipeline.py` for one mesh."""

import time
from collections.abc import Callable, Generator, Iterable
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from meshshard.errors import UsageError
from meshshard.files import lock_folder
from meshshard.index import Index, Rejection
from meshshard.recipe import Recipe
from meshshard_prep import staging
from meshshard_prep.datasets.layout import RawDataset
from meshshard_prep.engines import Engine, on_this_machine
from meshshard_prep.ground import common_ground
from meshshard_prep.isolation import Limits
from meshshard_prep.jobs import Job, rejection
from meshshard_prep.pack import Packer, publish_dataset
from meshshard_prep.plan import Plan, make_plan
from meshshard_prep.work import Outcome, Task, compute


@dataclass(frozen=True, kw_only=True)
class Report:
    """What a run came to. `computed` of the stored samples are new; in = stored + refused + failed.
    `mesh_seconds`: what computing took, summed over the meshes; `removed`: stored before, without a raw file now."""

    index: Index
    computed: int
    seconds: float
    mesh_seconds: float
    removed: tuple[str, ...]

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
    engine: Engine | None = None,
    limits: Limits = Limits(),  # noqa: B008  frozen
    compute: Callable[[Job, Path, Recipe], Outcome] = compute,
    val_fraction: float = 0.15,
    split_seed: int = 0,
    train_fraction: float = 1.0,
    progress: Callable[[int, int, int], None] | None = None,
) -> Report:
    """Compute what is new, keep what is not, and publish `out` in one step, index.json last.

    `jobs`: workers on this machine, -1 for one a core; `engine` takes their place. `limits`: of each mesh.
    `compute`: what the isolated processes do. `progress(done, total, rejected)` is called after each computed mesh.
    A mesh that breaks a rule, or breaks its process, is in the report; the rest is stored. UsageError: two entries
    have one id, another run holds `out`, `out` holds another data set, or the machine is at fault and no mesh: then
    what was published before stays as it is.
    """
    start = time.perf_counter()
    with lock_folder(out):
        staging.prepare(out)
        plan = make_plan(dataset, out, recipe)
        _check_unreadable(plan, plan.rejected.values())
        packer = Packer(out, plan, recipe, dataset.classes)
        todo = [plan.jobs[name] for name in plan.todo]
        mesh_seconds = 0.0
        with common_ground(out, recipe) as ground:
            task = Task(out=out.resolve(), recipe=recipe, limits=limits, compute=compute, ground=ground)
            # closed here, not when the traceback of an error is forgotten: until then the workers would go on
            with closing(_map(task, todo, engine or partial(on_this_machine, workers=jobs))) as outcomes:
                for done, outcome in enumerate(outcomes, start=1):
                    mesh_seconds += outcome.seconds
                    if outcome.rejection is not None:
                        _check_unreadable(plan, [outcome.rejection])
                    packer.take(outcome)
                    if progress:
                        progress(done, len(todo), len(packer.rejected))
        index = publish_dataset(
            out,
            dataset,
            packer,
            plan.before,
            recipe=recipe,
            val_fraction=val_fraction,
            split_seed=split_seed,
            train_fraction=train_fraction,
        )
    return Report(
        index=index,
        computed=sum(job.entry.id not in packer.rejected for job in todo),
        seconds=time.perf_counter() - start,
        mesh_seconds=mesh_seconds,
        removed=plan.gone,
    )


def _check_unreadable(plan: Plan, rejected: Iterable[Rejection]) -> None:
    """What is stored is dropped when its file is gone or differs, not when the disk or the network fails."""
    lost = [entry for entry in rejected if entry.code == "unreadable" and entry.id in plan.before.stored]
    if lost:
        raise UsageError(
            f"{len(lost)} meshes are stored whose raw files cannot be read now; mend that, or take the files away. "
            f"The first: {lost[0].message}"
        )


def _map(task: Task, todo: list[Job], engine: Engine) -> Generator[Outcome, None, None]:
    """Exactly one outcome for each job. What an engine loses with its workers is given to it again, in the end one
    by one: any of them may be what kills the workers."""
    waiting = {job.entry.id: job for job in todo}
    progress = True
    while waiting and progress:
        progress = False
        with closing(engine(task, list(waiting.values()))) as outcomes:
            for outcome in outcomes:
                progress = True
                del waiting[outcome.id]
                yield outcome
    for name, job in waiting.items():
        message = f"{job.entry.source}: its worker died, also when it ran alone; run again [lost]"
        lost = Outcome(id=name, seconds=0.0, rejection=rejection(job.entry, "lost", message, ""))
        yield next(engine(task, [job]), lost)
