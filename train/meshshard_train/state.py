"""All that a run goes on from: what is saved after every epoch, and in long ones now and then."""

import json
from collections.abc import Callable
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from meshshard import Dataset, UsageError
from meshshard.files import publish
from meshshard.plain import to_json
from meshshard_train import checkpoint
from meshshard_train.checkpoint import Checkpoint
from meshshard_train.config import TrainConfig
from meshshard_train.model import TaskDrivenNet
from meshshard_train.schedule import best_epoch

LAST, BEST, METRICS, CONFIG = "last.safetensors", "best.safetensors", "metrics.jsonl", "config.json"


@dataclass(kw_only=True)
class State:
    """Where a run is. `average`: the moving average of the weights, by name, empty without one. `epoch`, `step`: the
    next to be done; `updates`: steps of all epochs. Of the epoch so far, `loss`: sum of the losses; `seen`: meshes;
    `seconds`: the time it took, of which `waited` for data. `trained`, `judges`: `members.keys_of` meshes that are
    learned from, and that choose the epoch. `forward`: what is called to train the network, itself if
    it is not compiled."""

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
    waited: float = 0.0
    trained: list[str] = field(default_factory=list)
    judges: list[str] = field(default_factory=list)
    forward: Callable[..., Tensor] = field(init=False)

    def __post_init__(self) -> None:
        self.forward = self.network

    def weights(self) -> dict[str, Tensor]:
        """What is evaluated and kept as best: the average where there is one."""
        return self.average or dict(self.network.state_dict())

    def end_epoch(self, row: dict[str, Any]) -> None:
        """Take its row into the history, and go to the start of the next epoch."""
        self.history.append(row)
        self.epoch, self.step, self.seen = self.epoch + 1, 0, 0
        self.loss, self.seconds, self.waited = 0.0, 0.0, 0.0

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
            "trained": state.trained,
            "judges": state.judges,
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


def publish_config(run: Path, config: TrainConfig) -> None:
    """Publish config.json, all settings of a run."""
    publish(run / CONFIG, to_json(asdict(config)).encode() + b"\n")


def publish_epoch(run: Path, state: State, dataset: Dataset, config: TrainConfig) -> None:
    """Publish what follows from a state that is saved as last: best.safetensors, where the epoch that just ended is
    the best, and metrics.jsonl. After a kill between the files, it is done again."""
    if not state.history:
        return
    if state.step == 0 and best_epoch(state.history) == state.epoch - 1:
        checkpoint.save(run / BEST, to_checkpoint(state, dataset, config))
    lines = "".join(json.dumps(row) + "\n" for row in state.history).encode()
    with checkpoint.told_to_make_room(run / METRICS, len(lines)):
        publish(run / METRICS, lines)


PLACE = ("history", "epoch", "step", "updates", "loss", "seen", "seconds", "waited")


def resume(run: Path, state: State, dataset: Dataset, config: TrainConfig) -> None:
    """Load the last checkpoint of a run into a state, where there is one. UsageError: it is damaged, or of another
    configuration, data or classes; or best.safetensors is not the one that belongs to it."""
    path = run / LAST
    if not path.exists():
        path = checkpoint.previous(path)  # killed between two renames
    if not path.exists():
        return
    before = _loaded(path)
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
    best = best_epoch(state.history)
    if best >= 0 and (best < state.epoch - 1 or state.step > 0):  # else it is written from this state
        found = _loaded(run / BEST).state["epoch"]
        if found != best:
            wrong = f"{run / BEST} is of epoch {found}, and the best of the epochs in {path} is {best}"
            raise UsageError(f"{wrong}{checkpoint.older(run / BEST)}; {_advice(run / BEST)}")


def _loaded(path: Path) -> Checkpoint:
    try:
        return checkpoint.load(path)
    except UsageError as error:
        raise UsageError(f"{error}; {_advice(path)}") from error


def _advice(path: Path) -> str:
    return f"delete {path.parent} to start anew, or choose another --run"


def _named(tensors: dict[str, Tensor], prefix: str) -> dict[str, Tensor]:
    return {name.removeprefix(prefix): value for name, value in tensors.items() if name.startswith(prefix)}
