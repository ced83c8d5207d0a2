"""Runs in programs of their own, and the processes they start, for tests that kill."""

import os
import subprocess
import sys
import time
from pathlib import Path

PARENT = """
import signal
import sys
from pathlib import Path
from faults import compute_or_fault
from meshshard.recipe import RECIPES
from meshshard_prep.datasets import read_dataset
from meshshard_prep.isolation import Limits
from meshshard_prep.run import run
limits = Limits(seconds=None)
def progress(done, total, rejected):
    if done == int(sys.argv[4]):
        signal.raise_signal(signal.SIGINT)
run(read_dataset(sys.argv[1]), Path(sys.argv[2]), RECIPES["paper"], jobs=int(sys.argv[3]), limits=limits,
    compute=compute_or_fault, progress=progress)
"""


def family_of(mark):
    """Processes that inherited MARK in their environment."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            if f"MARK={mark}".encode() in (folder / "environ").read_bytes().split(b"\0"):
                found.append(int(folder.name))
        except OSError:
            continue  # it ended, or is another user's
    return found


def wait_for_end(mark, end):
    """Until no process with that mark is left. AssertionError: at the time `end` there are some."""
    while left := family_of(mark):
        assert time.monotonic() < end, left
        time.sleep(0.02)


def start_run(raw, out, jobs, mark, interrupted=0):
    """A program that computes the features of a folder; it and its processes carry the mark. Ctrl-C comes to it
    after `interrupted` meshes, while it works itself and does not wait for others."""
    words = [sys.executable, "-c", PARENT, str(raw), str(out), str(jobs), str(interrupted)]
    environment = os.environ | {"MARK": mark, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    return subprocess.Popen(words, env=environment, start_new_session=True, stderr=subprocess.PIPE)
