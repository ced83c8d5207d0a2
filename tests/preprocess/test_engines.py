"""Workers of real clusters, over TCP on this machine: the same bytes, the same faults named, nothing lost."""

import contextlib
import os
import re
import signal
import subprocess
import sys
import time
from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest
from families import family_of
from faults import FAULTS, Murderous, compute_or_fault, raw_folder
from program import meshshard

from meshshard.errors import UsageError
from meshshard.files import sha256_of_file
from meshshard.recipe import RECIPES
from meshshard_prep import clusters, staging
from meshshard_prep.clusters import on_dask, on_ray
from meshshard_prep.engines import find_engine
from meshshard_prep.isolation import Limits
from meshshard_prep.run import run

LIMITS = Limits(seconds=1.0, memory=2 * 10**9)
BAD = {3: "segfault", 8: "hang", 13: "allocate"}
ENVIRONMENT = os.environ | {
    "PYTHONPATH": os.pathsep.join(filter(None, sys.path)),
    "MARK": f"dask {os.getpid()}",
    "DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "1",
}


class Dask:
    """A scheduler, and workers as they are started by hand."""

    def __init__(self, folder):
        self.log = folder / "log"
        self.processes = []
        self.start("scheduler", "--port", "0")
        while not (found := re.search(r"tcp://127.0.0.1:\d+", self.log.read_text())):
            assert self.processes[0].poll() is None, self.log.read_text()
            time.sleep(0.02)
        self.address = found.group()

    def start(self, what, *words, environment=ENVIRONMENT):
        words = [
            sys.executable,
            "-m",
            f"distributed.cli.dask_{what}",
            "--host",
            "127.0.0.1",
            "--no-dashboard",
            *words,
        ]
        with self.log.open("a") as log:
            self.processes.append(subprocess.Popen(words, env=environment, stderr=log))

    def client(self):
        from distributed import Client

        return Client(self.address, set_as_default=False)

    def stop(self):
        for process in reversed(self.processes):
            process.terminate()
            process.wait()


@pytest.fixture(scope="session")
def dask(tmp_path_factory):
    """Two workers."""
    cluster = Dask(tmp_path_factory.mktemp("dask"))
    for _ in range(2):
        cluster.start("worker", cluster.address, "--nthreads", "1")
    with cluster.client() as client:
        client.wait_for_workers(2, timeout=30)
    yield cluster
    cluster.stop()


@pytest.fixture(scope="session")
def ray():
    """A cluster of this machine's own, as `on_ray` starts it where no address is given."""
    ray = pytest.importorskip("ray")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", ENVIRONMENT["PYTHONPATH"])
        patch.setenv("MARK", f"ray {os.getpid()}")
        assert list(on_ray(print, [], None)) == []
    yield ray
    ray.shutdown()


@pytest.fixture(scope="session")
def alone(tmp_path_factory):
    """Sixteen meshes, three of them bad, and what one worker on this machine makes of them."""
    root = tmp_path_factory.mktemp("alone")
    dataset = raw_folder(root / "raw", 16, BAD)
    report = go(dataset, root / "out")
    assert {entry.id: entry.code for entry in report.index.failed} == {
        f"{number:02}-{fault}": FAULTS[fault][1] for number, fault in BAD.items()
    }
    return dataset, tree(root / "out")


def go(dataset, out, engine=None, compute=compute_or_fault):
    return run(dataset, out, RECIPES["paper"], jobs=1, engine=engine, limits=LIMITS, compute=compute)


def tree(folder):
    return {path.name: sha256_of_file(path) for path in folder.iterdir() if path.is_file() and path.name != ".lock"}


def at_work(mark):
    """Worker processes of a cluster that have meshes computed for them: parents of what carries its mark."""
    workers = set()
    for pid in family_of(mark):
        with contextlib.suppress(OSError):  # it ended
            if b"meshshard_prep.isolated" in Path(f"/proc/{pid}/cmdline").read_bytes().split(b"\0"):
                workers.add(int(Path(f"/proc/{pid}/stat").read_text().rsplit(")")[1].split()[1]))
    return workers


@pytest.mark.skipif(sys.platform != "linux", reason="workers are found in /proc")
@pytest.mark.parametrize("backend", ["dask", "ray"])
def test_the_same_bytes_with_a_worker_killed_in_mid_run(backend, alone, tmp_path, request):
    cluster = request.getfixturevalue(backend)
    engine = partial(on_dask, address=cluster.address) if backend == "dask" else partial(on_ray, address=None)
    dataset, expected = alone
    killed = []

    def killing(task, jobs):
        for number, outcome in enumerate(engine(task, jobs)):
            if number == 4:
                workers = at_work(f"{backend} {os.getpid()}")
                assert workers  # perhaps not yet all of the cluster's: one may be starting while another works
                killed.append(workers.pop())
                os.kill(killed[0], signal.SIGKILL)
            yield outcome

    report = go(dataset, tmp_path / "out", killing)
    assert len(killed) == 1
    assert report.computed == 13
    assert tree(tmp_path / "out") == expected


@pytest.mark.usefixtures("ray")
def test_a_worker_that_differs_from_the_run_ends_it_with_the_reason(dask, alone, tmp_path):
    dataset, _ = alone
    for engine in (partial(on_dask, address=dask.address), partial(on_ray, address=None)):

        def elsewhere(task, jobs, engine=engine):
            ground = replace(task.ground, mark=Path("/elsewhere/.staging/mark"))
            return engine(replace(task, ground=ground), jobs)

        def older(task, jobs, engine=engine):
            ground = replace(task.ground, versions=(("meshshard", "0.0.1"), *task.ground.versions[1:]))
            return engine(replace(task, ground=ground), jobs)

        with pytest.raises(
            UsageError, match="does not see what this run wrote to /elsewhere; give an --out on a file"
        ):
            go(dataset, tmp_path / "out", elsewhere)
        with pytest.raises(UsageError, match=r"has meshshard \S+ and this run 0.0.1, .* install the same there"):
            go(dataset, tmp_path / "out", older)


def test_dask_without_workers_and_with_one_that_lacks_meshshard(alone, tmp_path, monkeypatch):
    dataset, _ = alone
    cluster = Dask(tmp_path)
    engine = partial(on_dask, address=cluster.address)
    try:
        monkeypatch.setattr(clusters, "PATIENCE", 0.2)
        with pytest.raises(UsageError, match=f"has no workers; start some: `dask worker {cluster.address}`"):
            go(dataset, tmp_path / "out", engine)
        monkeypatch.setattr(clusters, "PATIENCE", 20.0)
        (tmp_path / "sitecustomize.py").write_text("import sys; sys.modules['meshshard_prep'] = None")
        cluster.start("worker", cluster.address, environment=ENVIRONMENT | {"PYTHONPATH": str(tmp_path)})
        with pytest.raises(
            UsageError, match=r"ModuleNotFoundError: .*meshshard_prep.*; it needs what is here: pip inst"
        ):
            go(dataset, tmp_path / "out", engine)
    finally:
        cluster.stop()


def test_nobody_at_the_address(alone, tmp_path, monkeypatch):
    monkeypatch.setattr("ray.is_initialized", lambda: False)
    monkeypatch.setattr(clusters, "ANSWER", 0.5)
    for engine in (on_dask, on_ray):
        for address in ("127.0.0.1:1", "tcp://nowhere.invalid:1", "strange://x"):
            start = time.monotonic()
            with pytest.raises(UsageError, match=f"no .* answers at {address} .*; start one with `"):
                go(alone[0], tmp_path / "out", partial(engine, address=address))
            assert time.monotonic() - start < 5


def test_interrupted_on_dask_it_takes_back_what_is_queued(dask, alone, tmp_path):
    def interrupted(task, jobs):
        for number, outcome in enumerate(on_dask(task, jobs, dask.address)):
            yield outcome
            if number == 2:
                raise KeyboardInterrupt

    with dask.client() as client:
        with pytest.raises(KeyboardInterrupt):
            go(alone[0], tmp_path / "out", interrupted)
        end = time.monotonic() + 5
        while client.run_on_scheduler(lambda dask_scheduler: len(dask_scheduler.tasks)):
            assert time.monotonic() < end
            time.sleep(0.02)
    assert len(staging.staged(tmp_path / "out")) < 12


def test_a_mesh_that_kills_every_worker_of_dask_is_found(dask, tmp_path):
    dataset = raw_folder(tmp_path / "raw", 6, {})

    def engine(task, jobs):
        return on_dask(Murderous(task, "03"), jobs, dask.address)

    report = go(dataset, tmp_path / "out", engine)
    assert [(entry.id, entry.code) for entry in report.index.failed] == [("03", "lost")]
    assert len(report.index.ids) == 5


def test_options_that_do_not_fit_together():
    for words, message in {
        ("spark", None, -1): "--backend is one of loky, dask, ray, not 'spark'",
        ("dask", None, -1): "--backend dask needs the --address",
        ("loky", "tcp://a:1", -1): "--address tcp://a:1 is for --backend dask or ray",
        ("ray", None, 2): "--jobs is for workers on this machine",
    }.items():
        with pytest.raises(UsageError, match=message):
            find_engine(*words)


def test_the_commands(dask, ray, tmp_path):
    raw_folder(tmp_path / "raw", 4, {})
    addresses = {"dask": dask.address, "ray": ray.get_runtime_context().gcs_address}
    for backend, address in addresses.items():
        words = ["features", "raw", "--out", backend, "--backend", backend, "--address", address]
        status, out, error = meshshard(*words, cwd=tmp_path, environment=ENVIRONMENT)
        assert status == 0, error
        assert "4 stored (4 new)" in out
    assert tree(tmp_path / "dask") == tree(tmp_path / "ray")
