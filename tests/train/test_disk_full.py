"""A disk that is full while a checkpoint is written: what was saved stays, and the run goes on."""

import json
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
import torch
from disk_faults import fault_at
from samples import PAPER, toy_dataset
from training import CONFIG, rows, train_here

from meshshard.errors import UsageError
from meshshard_train import checkpoint
from meshshard_train.checkpoint import Checkpoint, previous
from meshshard_train.recipes import paper

MADE = Checkpoint(
    tensors={},
    config=paper("segmentation"),
    classes=("a", "b"),
    recipe=PAPER,
    splits_sha256="0" * 64,
    content_sha256="1" * 64,
    state={},
)


def of(number):
    return replace(MADE, tensors={"x": torch.full((9,), float(number))})


def number_of(path):
    return int(checkpoint.load(path).tensors["x"][0])


@pytest.mark.parametrize("kind", ["ENOSPC", "EIO", "short"])
def test_whichever_call_fails_what_was_saved_is_whole(tmp_path, kind):
    path = tmp_path / "last"
    checkpoint.save(path, of(0))
    checkpoint.save(path, of(1))
    with fault_at(0, kind) as made:
        checkpoint.save(path, of(2))
    calls = next(made) - 1
    messages = []
    for position in range(1, calls + 1):
        before = number_of(path)
        try:
            with fault_at(position, kind):
                checkpoint.save(path, of(before + 1))
        except UsageError as error:
            messages.append(str(error))
        newest = path if path.exists() else previous(path)
        assert number_of(newest) in (before, before + 1)
        assert number_of(previous(path)) in (before - 1, before)
        checkpoint.save(path, of(before + 1))
        assert (number_of(path), number_of(previous(path))) == (before + 1, before)
        for left in tmp_path.glob(".tmp-*"):
            left.unlink()  # as the lock of the folder does
    assert len(messages) >= (1 if kind == "short" else calls - 2)
    for message in messages:
        assert "last cannot be written: " in message
        assert "make room, and the same command goes on" in message


SCRIPT = """
import json, subprocess, sys
from dataclasses import replace
from training import CONFIG, rows, train_here
from meshshard import UsageError
from meshshard_train import checkpoint
folder, data = Path(sys.argv[1]), Path(sys.argv[2])
config = replace(CONFIG, ema=0.0, width=64, learning_rate=2e-3)
try:
    train_here(data, folder / "run", config)
except UsageError as error:
    message = str(error)
epoch = checkpoint.load(folder / "run" / "last.safetensors").state["epoch"]
subprocess.run(["mount", "-o", "remount,size=400m", folder], check=True)
history = train_here(data, folder / "run", config)
print(json.dumps([message, epoch, rows(history)]))
"""


def test_a_small_file_system_that_is_made_larger(tmp_path):
    """A checkpoint takes 4 MB, and a file system of 6 MB has no room for the second beside the first."""
    data, small = toy_dataset(tmp_path / "data"), tmp_path / "small"
    small.mkdir()
    mount = 'mount -t tmpfs -o size=6m none "$0" || exit 77; exec "$@"'
    code = "from pathlib import Path\nimport sys\nsys.path.insert(0, sys.argv.pop(1))\n" + SCRIPT
    program = [sys.executable, "-c", code, str(Path(__file__).parents[1]), str(small), str(data)]
    done = subprocess.run(
        ["unshare", "--user", "--map-root-user", "--mount", "sh", "-c", mount, str(small), *program],
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode in (1, 77) and "Traceback" not in done.stderr:
        pytest.skip("this system lets nobody but root mount a file system")
    message, epoch, history = json.loads(done.stdout)
    wanted = r"last.safetensors cannot be written: No space left .*; it takes 3.\d MB, and \d+.\d MB are free"
    assert re.search(wanted, message)
    assert epoch == 1
    config = replace(CONFIG, ema=0.0, width=64, learning_rate=2e-3)
    assert history == rows(train_here(data, tmp_path / "unbroken", config))
