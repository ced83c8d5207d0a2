"""Workers on other machines: dask and ray, with the interface of `engines.py`.

Both are used through their futures: in joblib's backends for them one lost job ends the whole call. Two jobs are in
flight for each place where one can run. Both clusters give a job to another worker when they lose the first; one
that kills worker after worker they give up, and its outcome is missing.
"""

import logging
import os
import pickle
import socket
import time
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import CancelledError
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from typing import Any

from meshshard.errors import MeshshardError, UsageError
from meshshard_prep.engines import Task
from meshshard_prep.jobs import Job
from meshshard_prep.work import Outcome

ANSWER = 10.0
"""Seconds to wait for a cluster to answer."""

PATIENCE = 30.0
"""Seconds to wait for a worker while there is none."""

IN_FLIGHT = 2
"""Jobs sent out for each place: one is computed, one waits beside it."""


def on_dask(task: Task, jobs: Sequence[Job], address: str) -> Generator[Outcome, None, None]:
    """Workers of the dask scheduler at `address`. UsageError: it does not answer, has no workers, or one of them
    is set up differently."""
    from distributed import Client, KilledWorker
    from distributed.comm import resolve_address

    try:
        resolve_address(address)  # a name that is none is known at once
        client = Client(address, timeout=ANSWER, set_as_default=False)
    except (OSError, ValueError) as error:
        raise UsageError(
            f"no dask scheduler answers at {address} ({error}); start one with `dask scheduler`, and give the "
            "address that it prints"
        ) from error
    arrived: SimpleQueue[Any] = SimpleQueue()
    flying = set()  # a future that nobody holds is cancelled

    def submit(job: Job) -> None:
        future = client.submit(pickle.loads, pickle.dumps(_Call(task, job)), pure=False)
        flying.add(future)
        future.add_done_callback(arrived.put)

    def places() -> int:
        try:
            return sum(client.nthreads().values())
        except OSError:  # the scheduler is gone, and the client tries to find it again
            return 0
        except RuntimeError as error:  # for too long: the client is closed
            raise UsageError(
                f"the dask scheduler at {address} has gone; what is done is kept: start it and its workers, "
                "and the same command goes on from there"
            ) from error

    def receive(future: Any) -> Outcome | None:
        flying.remove(future)
        try:
            return future.result(timeout=PATIENCE)
        except (KilledWorker, CancelledError, TimeoutError):
            return None

    nobody = f"the dask scheduler at {address} has no workers; start some: `dask worker {address}`"
    with client:  # closed, it takes back what is queued
        yield from _through(jobs, submit, arrived, receive, places, nobody)


def on_ray(task: Task, jobs: Sequence[Job], address: str | None) -> Generator[Outcome, None, None]:
    """Workers of the ray cluster at `address`; without one, a cluster is started that is this machine, and ends with
    this process. UsageError: it does not answer, or a worker is set up differently."""
    import ray
    from ray.exceptions import RayError, RayTaskError

    if not ray.is_initialized():
        _start_ray(address)
    run = ray.remote(num_cpus=1)(_run)
    arrived: SimpleQueue[Any] = SimpleQueue()
    flying = {}

    def submit(job: Job) -> None:
        reference = run.remote(task, job)
        future = reference.future()
        flying[future] = reference
        future.add_done_callback(arrived.put)

    def places() -> int:
        return int(ray.cluster_resources().get("CPU", 0))

    def receive(future: Any) -> Outcome | None:
        del flying[future]
        try:
            return future.result()
        except RayTaskError as error:
            raise error.cause from None
        except RayError:
            return None

    nobody = "the ray cluster has no CPUs to work on; start some: `ray start --address HOST:PORT`"
    try:
        yield from _through(jobs, submit, arrived, receive, places, nobody)
    finally:
        for reference in flying.values():
            ray.cancel(reference)


def _through(
    jobs: Sequence[Job],
    submit: Callable[[Job], None],
    arrived: SimpleQueue[Any],
    receive: Callable[[Any], Outcome | None],
    places: Callable[[], int],
    nobody: str,
) -> Generator[Outcome, None, None]:
    """Keep as many jobs in flight as there are places for, and yield what comes back. `submit` sends a job, whose
    future is put into `arrived` when it is done; `receive` opens it, None where its workers were lost."""
    waiting = iter(jobs)
    left, in_flight, room = len(jobs), 0, 0
    looked, seen = -1.0, time.monotonic()
    while left or in_flight:
        now = time.monotonic()
        if now - looked >= 1:  # workers come and go
            looked, room = now, IN_FLIGHT * places()
            seen = now if room else seen
            if now - seen > PATIENCE:
                raise UsageError(f"{nobody}; what is done is kept")
        while left and in_flight < room:
            submit(next(waiting))
            left, in_flight = left - 1, in_flight + 1
        try:
            future = arrived.get(timeout=1)
        except Empty:
            continue
        in_flight -= 1
        try:
            outcome = receive(future)
        except MeshshardError:
            raise
        except Exception as error:
            raise UsageError(
                f"a worker could not do its work ({type(error).__name__}: {error}); it needs what is here: "
                "pip install 'meshshard[preprocess,distributed]'"
            ) from error
        if outcome is not None:
            yield outcome


@dataclass(frozen=True)
class _Call:
    """A task and its job, pickled so that to unpickle them is to call. A dask worker unpickles messages before it
    looks at them, and dies of a class that it cannot import; of bytes it does not, and says what is missing."""

    task: Task
    job: Job

    def __reduce__(self) -> tuple[Task, tuple[Job]]:
        return self.task, (self.job,)


def _run(task: Task, job: Job) -> Outcome:
    return task(job)


def _start_ray(address: str | None) -> None:
    import ray

    if address not in (None, "auto"):
        host, _, port = address.rpartition(":")
        try:  # ray itself would try for ten minutes
            socket.create_connection((host, int(port)), timeout=ANSWER).close()
        except (OSError, ValueError) as error:
            raise UsageError(_NO_RAY.format(address, error)) from error
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")  # a cluster of our own tells nobody
    try:
        ray.init(address=address or "local", log_to_driver=False, logging_level=logging.ERROR)
    except ConnectionError as error:
        raise UsageError(_NO_RAY.format(address, error)) from error


_NO_RAY = (
    "no ray cluster answers at {} ({}); start one with `ray start --head`, and give the address that it prints, "
    "HOST:PORT, or auto on a machine of the cluster; if it asks for a token, set RAY_AUTH_MODE=token here too"
)
