"""What a bad mesh can do to the process that computes it. Meshes are named after the fault they bring."""

import ctypes
import itertools
import os
import signal
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from shapes import bumpy, write_obj

from meshshard_prep.datasets import read_dataset
from meshshard_prep.work import Task, compute


def segfault():
    ctypes.string_at(0)


def kill():
    os.kill(os.getpid(), signal.SIGKILL)


def leave():
    os._exit(3)


def system_exit():
    sys.exit("a library thinks it is a program")


def memory_error():
    raise MemoryError("no more")


def allocate():
    np.ones(10 * 2**30, dtype=np.uint8)


def abort():
    os.write(2, b"terminate called after throwing an instance of 'std::bad_alloc'\n")
    os.abort()


def hang():
    """An endless loop in C, which holds the interpreter's lock and takes no notice of signals."""
    sum(itertools.repeat(0))


def unpicklable():
    class Strange(Exception):
        pass

    raise Strange("no module has this class")


FAULTS = {
    "segfault": (segfault, "crashed", "signal SIGSEGV"),
    "kill": (kill, "killed", "signal SIGKILL"),
    "leave": (leave, "crashed", "exit status 3"),
    "system_exit": (system_exit, "error", "SystemExit: a library thinks it is a program"),
    "memory_error": (memory_error, "memory-limit", "more memory than allowed; no more"),
    "allocate": (allocate, "memory-limit", "Unable to allocate 10.0 GiB"),
    "abort": (abort, "memory-limit", "std::bad_alloc"),
    "hang": (hang, "time-limit", "it was stopped after 5 s"),
    "unpicklable": (unpicklable, "error", "Strange: no module has this class"),
}
"""Name -> what happens, the code it is told by, words of its cause."""


def raw_folder(root, count, faults):
    """`count` small meshes; `faults`: position -> the fault that the mesh there brings."""
    for number in range(count):
        name = f"{number:02}-{faults[number]}" if number in faults else f"{number:02}"
        write_obj(root / f"{name}.obj", *bumpy(number, 0))
    return read_dataset(str(root))


def compute_or_fault(job, out, recipe):
    """In place of `compute`: a mesh whose name ends in -FAULT brings that fault."""
    name = job.entry.id.rpartition("-")[2]
    if name in FAULTS:
        FAULTS[name][0]()
    return compute(job, out, recipe)


@dataclass(frozen=True)
class Murderous:
    """A task that kills its worker, from outside of what is isolated: always over the mesh `name`, or, where there
    is a `flag`, once."""

    task: Task
    name: str
    flag: Path | None = None

    def __call__(self, job):
        if job.entry.id == self.name and not (self.flag and self.flag.exists()):
            if self.flag:
                self.flag.touch()
            kill()
        return self.task(job)
