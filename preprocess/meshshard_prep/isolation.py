"""Calls in a process of their own: a crash, a hang or too much memory costs one call, and its cause is known.

One process does one thing at a time, so that there is never a doubt over what killed it. It is kept for the next
call, because starting it takes longer than computing a mesh.
"""

import os
import select
import signal
import subprocess
import sys
import tempfile
import threading
import weakref
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from pathlib import Path
from typing import IO, Any, TypeVar

from meshshard.errors import UsageError
from meshshard_prep.lost import Lost

Result = TypeVar("Result")


@dataclass(frozen=True, kw_only=True)
class Limits:
    """Of one call: wall-clock seconds, and bytes on top of what the idle process holds; None for no limit."""

    seconds: float | None = 600.0
    memory: int | None = 8 * 10**9

    def __post_init__(self) -> None:
        for what, value, most in (("time", self.seconds, 10**6), ("memory", self.memory, 10**15)):
            if value is not None and not 0 < value <= most:
                raise UsageError(f"the {what} limit is above 0 and at most {most:.0e}, or none, not {value}")


class Isolated:
    """One process and the pipe to it; started at the first call, and anew after it was lost. `program`: the module
    that runs there and calls `isolated.main`. `warm_up`: a function and its arguments, called first in every new
    process, without limits."""

    def __init__(self, program: str = "meshshard_prep.isolated") -> None:
        self.program = program
        self.warm_up: tuple[Callable[..., None], tuple[Any, ...]] | None = None
        self._process: subprocess.Popen[bytes] | None = None

    def call(self, function: Callable[..., Result], *arguments: Any, limits: Limits) -> Result:
        """`function(*arguments)` over there. `function` is a module's own, arguments and result are pickled.

        Errors of meshshard's are raised here too. Lost: the process, or one that it called, crashed, took too long,
        too much memory, or the function raised anything else. UsageError: no process can be started, or it cannot
        warm up.
        """
        if self._process is None:
            self._start()
            self._warm_up()
        self._stderr.seek(0)  # the position is shared with the idle process: what it writes is about this call
        self._stderr.truncate()
        try:
            self._link.send((function, arguments, limits.memory))
            if not self._poll.poll(None if limits.seconds is None else 1000 * limits.seconds):
                raise Lost("time-limit", f"it was stopped after {limits.seconds:g} s")
            kind, value = self._link.recv()
        except (EOFError, OSError):
            raise self._death() from None
        except BaseException:
            self.stop()
            raise
        if kind == "result":
            return value
        if kind == "refusal":
            raise value
        if kind == "lost":
            raise Lost(*value)
        if kind == "memory":
            self.stop()  # what it still holds is not known
            raise Lost("memory-limit", f"it needs more memory than allowed; {value or 'an allocation failed'}")
        raise Lost("error", value)

    def _warm_up(self) -> None:
        if self.warm_up is None:
            return
        function, arguments = self.warm_up
        try:
            self.call(function, *arguments, limits=Limits(seconds=None, memory=None))
        except BaseException as error:
            self.stop()  # else the next call would find it cold
            if isinstance(error, Lost) and error.code != "killed":
                raise UsageError(
                    f"nothing can be computed here: {error}; look at the installation of meshshard[preprocess]"
                ) from error
            raise

    def _start(self) -> None:
        try:
            self._spawn()
        except OSError as error:
            raise UsageError(
                f"a process cannot be started: {error.strerror}; take fewer --jobs, or look at the space in "
                f"{tempfile.gettempdir()} and the limits of processes and open files"
            ) from error

    def _spawn(self) -> None:
        self._link, inner = Pipe()
        self._stderr = tempfile.TemporaryFile()  # noqa: SIM115  closed by _end
        environment = os.environ | {
            "PYTHONPATH": os.pathsep.join(path or str(Path.cwd()) for path in sys.path),
            # the parallel processes share the cores: one thread for each
            "OMP_NUM_THREADS": "1",
            "OPENBLAS_NUM_THREADS": "1",
            "MKL_NUM_THREADS": "1",
        }
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", self.program, str(inner.fileno()), str(os.getpid())],
            pass_fds=[inner.fileno()],
            stdin=subprocess.DEVNULL,
            stdout=self._stderr,
            stderr=self._stderr,
            env=environment,
            start_new_session=True,  # Ctrl-C is for the parent
        )
        inner.close()
        self._poll = select.poll()  # the connection's own would be made anew for every call
        self._poll.register(self._link, select.POLLIN)
        self._end = weakref.finalize(self, _end, self._process, self._link, self._stderr)

    def _death(self) -> Lost:
        """Why the process is no more, from its exit status and the last line it wrote."""
        assert self._process is not None
        try:
            status = self._process.wait(timeout=1)
        except subprocess.TimeoutExpired:  # it closed its end of the pipe, and goes on
            self._process.kill()
            status = self._process.wait()
        self._stderr.seek(max(self._stderr.seek(0, os.SEEK_END) - 10_000, 0))
        lines = self._stderr.read().decode(errors="replace").split("\n")
        last = next((line.strip()[:200] for line in reversed(lines) if line.strip()), "")
        self.stop()
        names = {number.value: number.name for number in signal.Signals}
        how = f"signal {names.get(-status, -status)}" if status < 0 else f"exit status {status}"
        cause = f"its process ended with {how}" + (f", after the words: {last}" if last else "")
        if status == -signal.SIGKILL:
            return Lost("killed", cause)
        return Lost("memory-limit" if "bad_alloc" in last or "MemoryError" in last else "crashed", cause)

    def stop(self) -> None:
        """Kill the process; the next call starts another one."""
        if self._process is not None:
            self._end()
            self._process = None


def _end(process: subprocess.Popen[bytes], link: Connection, stderr: IO[bytes]) -> None:
    process.kill()
    process.wait()
    link.close()
    stderr.close()


_of_thread = threading.local()


def isolated(warm_up: Callable[..., None], *arguments: Any, program: str = "meshshard_prep.isolated") -> Isolated:
    """The process of the calling thread that runs a program, kept from call to call; it ends with the thread. A
    process that starts makes the call `warm_up(*arguments)` first, without limits."""
    process: Isolated = vars(_of_thread).setdefault(program, Isolated(program))
    process.warm_up = warm_up, arguments
    return process
