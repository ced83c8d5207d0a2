"""R3: whatever one mesh does to its process, the others are stored and the culprit is named with its cause."""

import os
import signal
import subprocess
import sys
import time

import pytest
from effort import SOAKING
from families import family_of, start_run, wait_for_end
from faults import FAULTS, compute_or_fault, raw_folder

from meshshard import open_dataset
from meshshard.errors import FAILURES
from meshshard.recipe import RECIPES
from meshshard.verify import verify
from meshshard_prep.datasets import read_dataset
from meshshard_prep.isolation import Isolated, Limits
from meshshard_prep.lost import Lost
from meshshard_prep.run import run

PAPER = RECIPES["paper"]
LIMITS = Limits(seconds=5.0, memory=2 * 10**9)
"""So long that on a busy machine too only what hangs takes it."""


@pytest.fixture
def process():
    process = Isolated()
    yield process
    process.stop()


def test_results_come_back_and_the_process_is_kept(process):
    first = process.call(os.getpid, limits=LIMITS)
    assert first != os.getpid()
    assert process.call(os.getpid, limits=LIMITS) == first
    assert process.call(divmod, 7, 2, limits=LIMITS) == (3, 1)


@pytest.mark.parametrize("fault", FAULTS)
def test_every_fault_is_named(process, fault):
    function, code, cause = FAULTS[fault]
    with pytest.raises(Lost) as lost:
        process.call(function, limits=LIMITS)
    assert (lost.value.code, code in FAILURES) == (code, True)
    assert cause in lost.value.cause
    assert process.call(len, "next", limits=LIMITS) == 4


def test_limits_hold_for_one_call_only(process):
    with pytest.raises(Lost, match="memory"):
        process.call(bytes, 10**9, limits=Limits(memory=10**8))
    assert len(process.call(bytes, 10**8, limits=Limits(memory=None))) == 10**8


def test_last_words_are_those_of_this_call(process):
    process.call(os.write, 2, b"harmless\n", limits=LIMITS)
    with pytest.raises(Lost) as lost:
        process.call(os._exit, 1, limits=LIMITS)
    assert lost.value.cause == "its process ended with exit status 1"


POSITIONS = range(40) if SOAKING else (0, 39)


@pytest.mark.soak
@pytest.mark.parametrize("fault", [f for f in FAULTS if f in ("segfault", "hang") or SOAKING])
def test_one_fault_at_any_position_costs_one_mesh(tmp_path, fault, measured):
    for position in POSITIONS:
        dataset = raw_folder(tmp_path / f"raw{position}", 40, {position: fault})
        out = tmp_path / f"out{position}"
        report = run(dataset, out, PAPER, jobs=2, limits=LIMITS, compute=compute_or_fault)
        assert len(report.index.ids) == 39
        assert not report.index.refused
        (culprit,) = report.index.failed
        _, code, cause = FAULTS[fault]
        assert (culprit.id, culprit.code) == (f"{position:02}-{fault}", code)
        assert cause in culprit.message
        assert verify(out) == []
    measured("R3", f"{fault} at {len(POSITIONS)} positions of 40 meshes: the other 39 stored, the culprit named")


def test_all_faults_in_one_run(tmp_path):
    faults = dict(enumerate(FAULTS, start=5))
    report = run(raw_folder(tmp_path / "raw", 20, faults), tmp_path / "out", PAPER, jobs=2, limits=LIMITS,
                 compute=compute_or_fault)  # fmt: skip
    assert {entry.id: entry.code for entry in report.index.failed} == {
        f"{number:02}-{name}": FAULTS[name][1] for number, name in faults.items()
    }
    assert len(open_dataset(tmp_path / "out")) == 20 - len(FAULTS)
    # without the faults, the next run computes those and no others
    assert run(read_dataset(str(tmp_path / "raw")), tmp_path / "out", PAPER, jobs=1).computed == len(FAULTS)
    assert verify(tmp_path / "out", full=True) == []


def start_family(tmp_path, jobs, mark):
    """A run whose last mesh never ends, with all else done."""
    parent = start_run(tmp_path / "raw", tmp_path / "out", jobs, mark)
    while len(list((tmp_path / "out" / ".staging").glob("[!.]*.sample"))) < 4:
        assert parent.poll() is None
        time.sleep(0.01)
    assert len(family_of(mark)) > jobs
    return parent


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere a worker ends when it looks at its pipe")
@pytest.mark.parametrize("jobs", [1, 2])
@pytest.mark.parametrize("how", [signal.SIGTERM, signal.SIGKILL, "group"])
def test_no_orphans_after_any_death_of_the_parent(tmp_path, jobs, how):
    raw_folder(tmp_path / "raw", 5, {4: "hang"})
    mark = f"{os.getpid()}-{time.monotonic_ns()}"
    parent = start_family(tmp_path, jobs, mark)
    if how == "group":
        os.killpg(parent.pid, signal.SIGKILL)
    else:
        parent.send_signal(how)
    parent.communicate()
    wait_for_end(mark, time.monotonic() + 2)


def last_words(parent):
    try:
        return parent.communicate(timeout=10)[1]
    except subprocess.TimeoutExpired:
        os.killpg(parent.pid, signal.SIGKILL)  # else it stands in the way of other tests
        parent.communicate()
        raise


@pytest.mark.parametrize("jobs", [1, 2])
def test_ctrl_c_ends_in_a_second_and_keeps_what_is_done(tmp_path, jobs):
    raw_folder(tmp_path / "raw", 5, {4: "hang"})
    mark = f"{os.getpid()}-{time.monotonic_ns()}"
    parent = start_family(tmp_path, jobs, mark)
    start = time.monotonic()
    os.killpg(parent.pid, signal.SIGINT)  # as a terminal does: to every process of the group
    errors = last_words(parent)
    assert time.monotonic() - start < 1
    assert errors.decode().strip().endswith("KeyboardInterrupt")
    assert errors.count(b"Traceback") == 1  # the parent's own; the program prints one line instead
    wait_for_end(mark, start + 2)
    assert run(read_dataset(str(tmp_path / "raw")), tmp_path / "out", PAPER, jobs=1).computed == 1


@pytest.mark.parametrize("jobs", [1, 2])
def test_ctrl_c_ends_also_a_parent_that_is_not_waiting(tmp_path, jobs):
    raw_folder(tmp_path / "raw", 5, {4: "hang"})
    mark = f"{os.getpid()}-{time.monotonic_ns()}"
    errors = last_words(start_run(tmp_path / "raw", tmp_path / "out", jobs, mark, interrupted=2))
    assert errors.decode().strip().endswith("KeyboardInterrupt")
    wait_for_end(mark, time.monotonic() + 2)
