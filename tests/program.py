"""The program `meshshard` as people call it: every call is a process of its own.

It is forked from a process that has already imported what takes long, so that a call costs what it does: importing
torch alone takes seconds. That commands import no more than they need is tested with processes that begin anew.
"""

import atexit
import gc
import json
import os
import runpy
import subprocess
import sys
import tempfile
import threading
import traceback
from functools import cache
from importlib import import_module
from pathlib import Path

HEAVY = (
    "matplotlib.pyplot",
    "meshshard_prep.pipeline",
    "meshshard_prep.run",
    "meshshard_train.seeds",
    "pydantic",
    "rich.console",
)
COARSE_DPI = 30
"""Of pictures in tests: most of the time of a small training was that of drawing them."""


def meshshard(*arguments, cwd=None, environment=None):
    """Exit status, standard output and standard error of one call, on one thread."""
    with tempfile.TemporaryDirectory() as folder:
        out, err = (Path(folder, name) for name in ("out", "err"))
        call = {
            "argv": ["meshshard", *map(str, arguments)],
            "cwd": str(cwd or Path.cwd()),
            "environ": os.environ | {"OMP_NUM_THREADS": "1"} | (environment or {}),
            "files": ["/dev/null", str(out), str(err)],
        }
        server = _server()
        server.stdin.write(json.dumps(call) + "\n")
        server.stdin.flush()
        return int(server.stdout.readline()), out.read_text(), err.read_text()


@cache
def _server():
    environment = os.environ | {"OMP_NUM_THREADS": "1"}
    words = [sys.executable, "-P", __file__]  # tests' modules are none of the program's
    server = subprocess.Popen(words, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    atexit.register(server.communicate)  # the end of its input is its end
    return server


def _serve():
    """A fork for each line of the input; its exit status is a line of the output."""
    for name in HEAVY:
        import_module(name)
    import_module("meshshard_train.pictures").DPI = COARSE_DPI
    gc.freeze()  # what is imported stays, so that calls do not look through it
    for line in sys.stdin:
        child = os.fork()
        if not child:
            _become(**json.loads(line))
        _, status = os.waitpid(child, 0)
        print(os.waitstatus_to_exitcode(status), flush=True)


def _become(argv, cwd, environ, files):
    for number, file in enumerate(files):
        os.dup2(os.open(file, os.O_RDWR | os.O_CREAT), number)
    os.chdir(cwd)
    os.environ.clear()
    os.environ.update(environ)
    sys.argv = argv
    status = 0
    try:
        runpy.run_module("meshshard", run_name="__main__", alter_sys=True)
    except SystemExit as end:
        status = end.code or 0
    except BaseException:  # noqa: BLE001 - told as the interpreter tells it
        traceback.print_exc()
        status = 1
    _leave(status)


def _leave(status):
    """Everything an end of Python does but taking modules down: after the imports above that takes a second."""
    threading._shutdown()  # waits for threads, as the interpreter does
    atexit._run_exitfuncs()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(status)


if __name__ == "__main__":
    _serve()
