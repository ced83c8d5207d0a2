"""Where the workers are: processes of this machine (joblib's loky), or of a cluster (dask, ray).

An engine maps a task over jobs and yields the outcomes as they come, in any order; closed early, it ends what is
under way. It keeps a bounded number of jobs in flight, and ends early, without an error, when workers die so often
that it gives up: the caller sees what did not come back.
"""

import os
import signal
from collections.abc import Callable, Generator, Sequence
from functools import partial

import joblib
from joblib.externals.loky.process_executor import TerminatedWorkerError

from meshshard.errors import UsageError
from meshshard_prep.isolated import die_with
from meshshard_prep.jobs import Job
from meshshard_prep.work import Outcome

Task = Callable[[Job], Outcome]
Engine = Callable[[Task, Sequence[Job]], Generator[Outcome, None, None]]

BACKENDS = ("loky", "dask", "ray")


def on_this_machine(task: Task, jobs: Sequence[Job], workers: int) -> Generator[Outcome, None, None]:
    """joblib's loky. `workers`: its n_jobs, -1 for one a core; with 1, this process is the worker."""
    parallel = joblib.Parallel(
        n_jobs=workers,
        return_as="generator_unordered",
        batch_size="auto",  # several small meshes at a time, one large one
        initializer=_start_worker,
        initargs=(os.getpid(),),
    )
    # workers inherit the mask: Ctrl-C is for the parent also while they start, else one dies holding loky's locks
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        outcomes = parallel(joblib.delayed(task)(job) for job in jobs)
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
    try:
        yield from outcomes
    except TerminatedWorkerError:
        return


def _start_worker(parent: int) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the parent, which ends its workers
    die_with(parent)


def find_engine(backend: str, address: str | None, workers: int) -> Engine:
    """The engine that --backend, --address and --jobs mean together. UsageError: they do not fit together."""
    if backend not in BACKENDS:
        raise UsageError(f"--backend is one of {', '.join(BACKENDS)}, not {backend!r}")
    if backend == "loky":
        if address:
            raise UsageError(f"--address {address} is for --backend dask or ray; give one of them")
        return partial(on_this_machine, workers=workers)
    from meshshard_prep.clusters import on_dask, on_ray

    if workers != -1:
        raise UsageError(f"--jobs is for workers on this machine; {backend} decides itself how many there are")
    if backend == "ray":
        return partial(on_ray, address=address)
    if not address:
        raise UsageError("--backend dask needs the --address that `dask scheduler` prints, as tcp://HOST:8786")
    return partial(on_dask, address=address)
