"""Training in processes of their own: killed at a chosen moment, or together as a team."""

import multiprocessing
import os
import signal
import socket
import sys
from dataclasses import replace
from itertools import count
from pathlib import Path

import torch

from meshshard import UsageError, open_dataset
from meshshard_train import checkpoint, loop
from meshshard_train.loading import Loading
from meshshard_train.loop import train
from meshshard_train.recipes import paper
from meshshard_train.state import BEST, LAST
from meshshard_train.team import joined

CPU = torch.device("cpu")
CONFIG = paper(
    "segmentation",
    width=16,
    epochs=2,
    passes=2,
    learning_rate=0.03,
    vertex_fraction=0.5,
    batch_vertices=150,
    precision="fp32",
    ema=0.5,
    schedule="constant",
)

SERVER = multiprocessing.get_context("forkserver")
SERVER.set_forkserver_preload(["meshshard_train.loop", "torch._dynamo"])  # which the optimiser imports, for seconds


def rows(history):
    """A history without what a clock measured."""
    return [{name: value for name, value in row.items() if name not in ("seconds", "waited")} for row in history]


def outcome(run):
    """All that a run leaves but times: what two runs that compute the same have alike."""
    last = checkpoint.load(run / LAST)
    place = {name: last.state[name] for name in ("epoch", "step", "updates", "loss", "seen")}
    tensors = {name: tensor.numpy().tobytes() for name, tensor in last.tensors.items()}
    return rows(last.state["history"]), place, tensors, (run / BEST).read_bytes()


def train_here(data, run, config=CONFIG, **more):
    """`train` on one processor core."""
    return train(open_dataset(data), config, run, CPU, **more)


def run_in_child(target, *arguments):
    """A started process that runs a function of a module."""
    process = SERVER.Process(target=_in_child, args=(target, arguments))
    process.start()
    return process


def _in_child(target, arguments):
    torch.set_num_threads(1)
    os.fsync = lambda descriptor: None  # noqa: ARG005
    target(*arguments)


def train_and_die(data, run, moment, save_seconds=300.0):
    """Train, and be killed at the `moment`-th of these: a rename, or news of a step or an epoch. 0: never."""
    loop.SAVE_SECONDS = save_seconds
    moments, rename = count(1), os.replace

    def come(*_):
        if next(moments) == moment:
            os.kill(os.getpid(), signal.SIGKILL)

    def replacing(*paths):
        come()
        rename(*paths)

    os.replace = replacing
    train_here(data, run, report=come)


def died(*arguments):
    """Run `train_and_die` in a process of its own; whether it was killed."""
    process = run_in_child(train_and_die, *arguments)
    process.join()
    assert process.exitcode in (0, -signal.SIGKILL)
    return process.exitcode != 0


def team_of(size, target, *arguments):
    """Started processes that find each other as those of `torchrun` do."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    shared = {"WORLD_SIZE": size, "LOCAL_WORLD_SIZE": size, "MASTER_ADDR": "127.0.0.1", "MASTER_PORT": port}
    return [
        run_in_child(as_member, shared | {"RANK": rank, "LOCAL_RANK": rank}, target, arguments)
        for rank in range(size)
    ]


def as_member(environment, target, arguments):
    """Join a team, call a function with it, and tell an error as the program does."""
    os.environ |= {name: str(value) for name, value in environment.items()}
    try:
        with joined("cpu") as (team, _):
            target(team, *arguments)
    except UsageError as error:
        Path(f"{arguments[0]}-error-{team.rank}").write_text(str(error))
        sys.exit(2)


def train_in_team(team, run, data, batch_vertices, keep_gib):
    """`train` by a member."""
    loading = Loading(keep_gib=keep_gib)
    train_here(data, run, replace(CONFIG, batch_vertices=batch_vertices), team=team, loading=loading)
