"""The inner side of isolation.py: a process that does one thing at a time, within limits, and dies with its parent.

Started as `python -m meshshard_prep.isolated DESCRIPTOR PARENT`; it ends when the other end of its pipe closes.
"""

import ctypes
import os
import resource
import signal
import sys
from multiprocessing.connection import Connection
from pathlib import Path

from meshshard.errors import MeshshardError
from meshshard_prep.lost import Lost

STATM = Path("/proc/self/statm")
PR_SET_PDEATHSIG = 1
MOST_BYTES_OF_A_FILE = 2**32


def die_with(parent: int) -> None:
    """Have the system kill this process as soon as its parent ends, however that ends. Linux only; elsewhere a
    process ends when it next looks at its pipe."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != parent:  # it died before the call
            os._exit(1)


def memory_left() -> int | None:
    """Bytes that this process may still take; None for no limit that is known. Linux only."""
    soft = resource.getrlimit(resource.RLIMIT_DATA)[0]
    return None if soft == resource.RLIM_INFINITY or not STATM.exists() else max(soft - _held(), 1)


def limit_memory(more: int | None) -> None:
    """Let this process use `more` bytes on top of what it has; allocations beyond fail. Linux only."""
    hard = resource.getrlimit(resource.RLIMIT_DATA)[1]
    soft = hard
    if more is not None and STATM.exists():
        soft = _held() + more if hard == resource.RLIM_INFINITY else min(_held() + more, hard)
    resource.setrlimit(resource.RLIMIT_DATA, (soft, hard))


def _held() -> int:
    return int(STATM.read_text().split()[5]) * resource.getpagesize()


def serve(link: Connection) -> None:
    """Answer calls until the pipe closes. An answer is its kind and a value: the result, an error that was raised
    on purpose, or the words of one that was not."""
    # what a library prints goes to a file of this process: it must not fill the disk
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    if soft == resource.RLIM_INFINITY:
        resource.setrlimit(resource.RLIMIT_FSIZE, (MOST_BYTES_OF_A_FILE, hard))
    while True:
        try:
            function, arguments, memory = link.recv()
        except EOFError:
            return
        limit_memory(memory)
        try:
            answer = "result", function(*arguments)
        except MeshshardError as error:
            answer = "refusal", error
        except Lost as lost:  # a process that this one called
            answer = "lost", (lost.code, lost.cause)
        except MemoryError as error:
            answer = "memory", str(error)
        except BaseException as error:  # noqa: BLE001  also SystemExit: whatever it is, it costs one call
            answer = "error", f"{type(error).__name__}: {error}"
        limit_memory(None)
        link.send(answer)


def main() -> None:
    """`python -m PROGRAM DESCRIPTOR PARENT`."""
    die_with(int(sys.argv[2]))
    serve(Connection(int(sys.argv[1])))


if __name__ == "__main__":
    main()
