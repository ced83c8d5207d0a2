"""R4: runs whose processes are killed at any time lose nothing that was done, and leave no process behind."""

import os
import signal
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from effort import times
from families import family_of, start_run, wait_for_end
from shapes import bumpy, write_obj

from meshshard.recipe import RECIPES
from meshshard_prep import staging
from meshshard_prep.datasets import read_dataset
from meshshard_prep.run import run

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="finds processes in /proc")

MESHES = 200


def victim_of(parent, mark, rng):
    """The parent, its group, a worker or an isolated process, as far as it is there: a name and a way to kill it."""
    roles = {"parent": [parent.pid], "group": [-parent.pid]}
    for pid in family_of(mark):
        try:
            words = Path(f"/proc/{pid}/cmdline").read_bytes()
        except OSError:
            continue
        if b"meshshard_prep.isolated" in words:
            roles.setdefault("isolated", []).append(pid)
        elif b"popen_loky_posix" in words:
            roles.setdefault("worker", []).append(pid)
    # the parent's death ends all: rarer, so that the others' deaths are seen too
    weights = np.array([1 if role in ("parent", "group") else 4 for role in roles])
    role = rng.choice(list(roles), p=weights / weights.sum())
    return role, int(rng.choice(roles[role]))


def files(folder):
    return {path.name: path.read_bytes() for path in folder.glob("[!.]*")}


@pytest.mark.soak
def test_killed_at_any_time_nothing_is_lost(tmp_path, measured):
    for number in range(MESHES):
        write_obj(tmp_path / "raw" / f"{number:03}.obj", *bumpy(number, 1))
    dataset = read_dataset(str(tmp_path / "raw"))
    run(dataset, tmp_path / "whole", RECIPES["paper"], jobs=2)
    rng = np.random.default_rng(int(time.time()) if times(0, 1) else 0)
    kills = {"parent": 0, "group": 0, "worker": 0, "isolated": 0}
    wanted, finished, cycle = times(12, 1000), 0, 0
    parent = None
    while sum(kills.values()) < wanted:
        out = tmp_path / f"out{finished}"
        if parent is None:
            cycle += 1
            mark = f"{os.getpid()}-{cycle}"
            parent = start_run(tmp_path / "raw", out, 2, mark)
            time.sleep(rng.uniform(0.5, 2.0))  # starting takes about one second
        time.sleep(rng.exponential(0.15))
        acknowledged = set(staging.staged(out))
        if parent.poll() is not None:  # it came to its end in spite of everything
            assert parent.communicate()[1].count(b"Traceback") == 0
            run(dataset, out, RECIPES["paper"], jobs=1)  # meshes killed twice have failed
            assert files(out) == files(tmp_path / "whole")
            finished, parent = finished + 1, None
            continue
        role, pid = victim_of(parent, mark, rng)
        try:
            os.killpg(-pid, signal.SIGKILL) if pid < 0 else os.kill(pid, signal.SIGKILL)
        except ProcessLookupError:
            continue
        kills[role] += 1
        if role in ("parent", "group"):
            parent.communicate()
            assert acknowledged <= set(staging.staged(out)) or (out / "index.json").exists()
            wait_for_end(mark, time.monotonic() + 2)
            parent = None
    if parent is not None:
        parent.communicate(timeout=60)
    run(dataset, out, RECIPES["paper"], jobs=2)
    assert files(out) == files(tmp_path / "whole")
    measured("R4", f"{kills}: nothing lost, no orphan after 2 s, {finished + 1} resumed trees equal the unbroken one")
