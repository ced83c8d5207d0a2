"""Several processes that train one network: started by `torchrun`, one a GPU, or some on a processor's cores.

Each takes its share of every step's meshes; gradients are summed, so that the losses are those of one process.
"""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import torch
import torch.distributed as dist
from torch import Tensor

T = TypeVar("T")


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
            dist.all_reduce(flat)
            for tensor, total in zip(tensors, flat.split([t.numel() for t in tensors]), strict=True):
                tensor.copy_(total.view_as(tensor))

    def gather(self, value: T) -> list[T]:
        """One value of each process, in the order of ranks, in all of them."""
        if self.size == 1:
            return [value]
        values: list[Any] = [None] * self.size
        dist.all_gather_object(values, value)
        return values

    def leave(self) -> None:
        """Say goodbye, where there is anyone."""
        if self.size > 1:
            dist.destroy_process_group()


def join(device: torch.device) -> Team:
    """The team that `torchrun` made this process part of; a team of one without it."""
    size = int(os.environ.get("WORLD_SIZE", "1"))
    if size == 1:
        return Team()
    if device.type == "cuda":
        torch.cuda.set_device(int(os.environ.get("LOCAL_RANK", "0")))
    dist.init_process_group("nccl" if device.type == "cuda" else "gloo")
    return Team(dist.get_rank(), size)
