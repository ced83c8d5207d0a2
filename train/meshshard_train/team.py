"""Several processes that train one network: started by `torchrun`, one a GPU, or some on a processor's cores.

Each takes its share of every step's meshes; gradients are summed, so that the losses are those of one process.
"""

import contextlib
import os
import signal
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import timedelta
from typing import Any, TypeVar

import torch
import torch.distributed as dist
from torch import Tensor
from torch.distributed.rendezvous import rendezvous

from meshshard import UsageError
from meshshard_train.config import TrainConfig
from meshshard_train.device import choose_device

T = TypeVar("T")

LONGEST_WAIT = timedelta(hours=2)
"""For each other: the first process writes checkpoints and results while the others wait."""


@dataclass(frozen=True)
class Team:
    """This process among those that train together. Alone, every method gives back what it is given."""

    rank: int = 0
    size: int = 1

    @property
    def leads(self) -> bool:
        """Whether this process writes files and tells."""
        return self.rank == 0

    def share(self, members: Sequence[T]) -> list[T]:
        """Those of this process: all of them together are all, each once."""
        return list(members[self.rank :: self.size])

    def sum_(self, tensors: Sequence[Tensor]) -> None:
        """Replace tensors of one kind by their sums over all processes."""
        if self.size > 1 and tensors:
            flat = torch.cat([tensor.flatten() for tensor in tensors])
            with _others_there():
                dist.all_reduce(flat)
            for tensor, total in zip(tensors, flat.split([t.numel() for t in tensors]), strict=True):
                tensor.copy_(total.view_as(tensor))

    def gather(self, value: T) -> list[T]:
        """One value of each process, in the order of ranks, in all of them."""
        if self.size == 1:
            return [value]
        values: list[Any] = [None] * self.size
        with _others_there():
            dist.all_gather_object(values, value)
        return values

    def check(self, config: TrainConfig) -> None:
        """UsageError: several processes would not compute what one does."""
        if self.size > 1 and config.normalisation == "batch":
            raise UsageError(
                "normalisation = batch keeps averages over the meshes in their order, which no process of several "
                "sees: train without torchrun, or with another normalisation"
            )

    def check_same(self, start: str) -> None:
        """UsageError: the processes do not start from the same data, settings and checkpoint, told as text."""
        if len(found := sorted(set(self.gather(start)))) > 1:
            raise UsageError(
                f"the processes of this training do not start alike: {' and '.join(found)}; all machines need the "
                "same data, and the folder of the run on a file system that all see"
            )


@contextlib.contextmanager
def joined(device: str) -> Iterator[tuple[Team, torch.device]]:
    """The team that `torchrun` made this process part of, or a team of one without it; and where it computes.

    An error is told by the first process that has one, and ends all: the others wait for `torchrun` to end them.
    """
    size = int(os.environ.get("WORLD_SIZE", "1"))
    if size == 1:
        yield Team(), choose_device(device)
        return
    store, rank, _ = next(rendezvous("env://", timeout=LONGEST_WAIT))
    try:
        place = choose_device(device)
        settle(place)
        backend = "nccl" if place.type == "cuda" else "gloo"
        dist.init_process_group(backend, store=store, rank=rank, world_size=size, timeout=LONGEST_WAIT)
        yield Team(rank, size), place
        dist.destroy_process_group()
    except BaseException:
        if store.add("errors", 1) > 1:
            signal.signal(signal.SIGINT, signal.SIG_DFL)
            time.sleep(60)
            raise SystemExit(2) from None
        raise


def settle(device: torch.device) -> None:
    """Take a GPU, or a share of the processor's cores, beside the other processes of this machine. UsageError: there
    are fewer GPUs than processes."""
    here = int(os.environ["LOCAL_WORLD_SIZE"])
    if device.type == "cuda":
        if here > torch.cuda.device_count():
            raise UsageError(
                f"{here} processes, and {torch.cuda.device_count()} GPUs here: torchrun --nproc-per-node takes at "
                "most one process a GPU, or train with --device cpu"
            )
        torch.cuda.set_device(int(os.environ["LOCAL_RANK"]))
    elif os.environ.get("OMP_NUM_THREADS") == "1":  # torchrun's choice for several, whatever the cores
        torch.set_num_threads(max(1, (os.cpu_count() or 1) // here))


@contextlib.contextmanager
def _others_there() -> Iterator[None]:
    try:
        yield
    except RuntimeError as error:
        raise UsageError(
            f"another process of this training has ended ({str(error).splitlines()[0]}); the same command goes on "
            "where it was saved last"
        ) from error
