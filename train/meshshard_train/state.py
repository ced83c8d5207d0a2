"""All that a run goes on from: what is saved after every epoch, and in long ones now and then."""

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from meshshard import Dataset, UsageError
from meshshard_train import checkpoint
from meshshard_train.checkpoint import Checkpoint
from meshshard_train.config import TrainConfig
from meshshard_train.model import TaskDrivenNet

LAST, BEST = "last.safetensors", "best.safetensors"


@dataclass(kw_only=True)
class State:
    """Where a run is. `average`: the moving average of the weights, by name, empty without one. `epoch`, `step`: the
    next to be done; `updates`: steps of all epochs; `loss`, `seen`, `seconds`: sum of the losses of the epoch so far,
    its meshes, and the time it took."""

    network: TaskDrivenNet
    optimizer: torch.optim.Optimizer
    average: dict[str, Tensor] = field(default_factory=dict)
    history: list[dict[str, Any]] = field(default_factory=list)
    epoch: int = 0
    step: int = 0
    updates: int = 0
    loss: float = 0.0
    seen: int = 0
    seconds: float = 0.0

    def weights(self) -> dict[str, Tensor]:
        """What is evaluated and kept as best: the average where there is one."""
        return self.average or dict(self.network.state_dict())

    @torch.no_grad()
    def follow(self, decay: float) -> None:
        """Move the average towards the network; early on faster, so that it forgets where it began."""
        if not self.average:
            return
        decay = min(decay, (1 + self.updates) / (10 + self.updates))
        for name, value in self.network.state_dict().items():
            self.average[name].lerp_(value, 1 - decay)


def started(network: TaskDrivenNet, config: TrainConfig) -> State:
    """A run before its first step."""
    optimizer = torch.optim.AdamW(
        network.parameters(), lr=config.learning_rate, weight_decay=config.weight_decay, fused=True
    )
    average = {name: value.clone() for name, value in network.state_dict().items()} if config.ema else {}
    return State(network=network, optimizer=optimizer, average=average)


def to_checkpoint(state: State, dataset: Dataset, config: TrainConfig) -> Checkpoint:
    """The network to evaluate, with what is needed to use it."""
    return Checkpoint(
        tensors={f"net.{name}": tensor for name, tensor in state.weights().items()},
        config=config,
        classes=dataset.classes,
        recipe=dataset.recipe,
        splits_sha256=dataset.index.splits_sha256,
        content_sha256=dataset.index.content_sha256,
        state={
            "epoch": len(state.history) - 1,
            "score": state.history[-1]["score"] if state.history else None,
            "folder": str(dataset.folder.resolve()),
            "dataset": dataset.name,
            "colours": list(dataset.index.colours),
            "algorithm_version": dataset.index.algorithm_version,
        },
    )


def save(path: Path, state: State, dataset: Dataset, config: TrainConfig) -> None:
    """Publish all of a state; the checkpoint that was there before stays as `previous-` and its name."""
    whole = to_checkpoint(state, dataset, config)
    tensors = {f"net.{name}": value for name, value in state.network.state_dict().items()}
    tensors |= {f"avg.{name}": value for name, value in state.average.items()}
    for number, slot in state.optimizer.state_dict()["state"].items():
        tensors |= {f"opt.{number}.{name}": value for name, value in slot.items()}
    place = {name: getattr(state, name) for name in PLACE}
    checkpoint.save(path, replace(whole, tensors=tensors, state=whole.state | place))


PLACE = ("history", "epoch", "step", "updates", "loss", "seen", "seconds")


def resume(run: Path, state: State, dataset: Dataset, config: TrainConfig) -> None:
    """Load the last checkpoint of a run into a state, where there is one. UsageError: it is damaged, or of another
    configuration, data or classes."""
    path = run / LAST
    if not path.exists():
        return
    try:
        before = checkpoint.load(path)
    except UsageError as error:
        raise UsageError(
            f"{error}; go on from the one before: mv {checkpoint.previous(path)} {path}; or delete {run} to start "
            "anew, or choose another --run"
        ) from error
    clashes = before.config.differences(config) + before.other_data(dataset)
    if clashes:
        raise UsageError(f"{run} holds a run with other settings; choose another --run. " + "; ".join(clashes))
    state.network.load_state_dict(_named(before.tensors, "net."))
    for name, value in _named(before.tensors, "avg.").items():
        state.average[name].copy_(value)
    slots: dict[int, dict[str, Tensor]] = {}
    for name, tensor in _named(before.tensors, "opt.").items():
        number, part = name.split(".")
        slots.setdefault(int(number), {})[part] = tensor
    state.optimizer.load_state_dict({"state": slots, "param_groups": state.optimizer.state_dict()["param_groups"]})
    for name in PLACE:
        setattr(state, name, before.state[name])


def _named(tensors: dict[str, Tensor], prefix: str) -> dict[str, Tensor]:
    return {name.removeprefix(prefix): value for name, value in tensors.items() if name.startswith(prefix)}
