"""Faults of system calls that write, at a chosen call: errors, writes cut short, and the end of the process."""

import contextlib
import errno
import os
from itertools import count

CALLS = ("open", "write", "fsync", "close", "replace", "unlink", "rmdir")
"""Functions of `os` that publishing uses."""

KINDS = ("ENOSPC", "EIO", "EMFILE", "short", "exit")


@contextlib.contextmanager
def fault_at(position, kind):
    """Have the call of that number fail, counted from 1 over all of CALLS; yields the counter of calls made.

    `kind`: an errno's name; "short", a write of half the bytes, and then a full disk; "exit", the end of the process
    before the call, as by a kill.
    """
    made = count(1)
    originals = {name: getattr(os, name) for name in CALLS}
    full = False

    def faulty(name):
        def call(*arguments, **options):
            nonlocal full
            number = next(made)
            if number == position and kind == "exit":
                os._exit(9)
            if name == "write" and (full or (number == position and kind == "short")):
                if full:
                    raise OSError(errno.ENOSPC, "No space left on device")
                full = True
                return originals["write"](arguments[0], arguments[1][: len(arguments[1]) // 2])
            if number == position and kind not in ("exit", "short"):
                if name == "close":
                    originals["close"](*arguments)
                raise OSError(getattr(errno, kind), kind)
            return originals[name](*arguments, **options)

        return call

    try:
        for name in CALLS:
            setattr(os, name, faulty(name))
        yield made
    finally:
        for name, original in originals.items():
            setattr(os, name, original)
