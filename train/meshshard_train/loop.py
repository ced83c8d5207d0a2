"""Training, read top to bottom. One run is one folder; started again, it goes on where it stopped, to the bit."""

import json
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import torch

from meshshard import Dataset, UsageError
from meshshard.files import publish
from meshshard_train import checkpoint
from meshshard_train.checkpoint import Checkpoint
from meshshard_train.config import TrainConfig
from meshshard_train.data import check_task, input_size, training_batches
from meshshard_train.device import autocast
from meshshard_train.evaluate import evaluate
from meshshard_train.loss import logits_of, mesh_losses
from meshshard_train.model import TaskDrivenNet

LAST, BEST, METRICS = "last.safetensors", "best.safetensors", "metrics.jsonl"


@dataclass(frozen=True, kw_only=True)
class Progress:
    """What `report` is told after each step and each epoch (`metrics` is then the line of metrics.jsonl)."""

    epoch: int
    meshes: int
    loss: float
    learning_rate: float
    metrics: dict[str, Any] | None = None


def train(
    dataset: Dataset,
    config: TrainConfig,
    run: Path,
    device: torch.device,
    report: Callable[[Progress], None] | None = None,
) -> list[dict[str, Any]]:
    """Train to the configuration's last epoch and return the history, one row an epoch.

    `run` gets last.safetensors (network and optimiser, after every epoch), best.safetensors (the epoch with the
    highest raw accuracy on the validation split; the first of equals) and metrics.jsonl. A run that is there goes on
    after its last epoch; UsageError when it was started with another configuration, data or classes.
    """
    check_task(dataset, config)
    train_numbers, val_numbers = _split(dataset, "train"), _split(dataset, "val")
    run.mkdir(parents=True, exist_ok=True)
    torch.manual_seed(config.seed)
    if device.type == "cpu":
        torch.use_deterministic_algorithms(True)
    network = TaskDrivenNet(input_size(config, len(dataset.recipe.times)), len(dataset.classes)).to(device)
    optimizer = torch.optim.AdamW(
        network.parameters(), lr=config.learning_rate, weight_decay=config.weight_decay, fused=True
    )
    history = _resume(run, dataset, config, network, optimizer)
    best = max((row["val_accuracy"] for row in history), default=-math.inf)

    for epoch in range(len(history), config.epochs):
        start, total, seen = time.perf_counter(), 0.0, 0
        network.train()
        for batch in training_batches(dataset, train_numbers, config, epoch):
            rate = learning_rate(config, epoch + seen / len(train_numbers))
            for group in optimizer.param_groups:
                group["lr"] = rate
            batch = batch.to(device)
            drop_VL = batch.drop_BL[batch.mesh_V] if batch.drop_BL is not None else None
            with autocast(config.precision, device):
                logits = logits_of(network(batch.features_VC, drop_VL), batch, config.task)
            losses_B = mesh_losses(logits, batch, config.task, config.label_smoothing)
            optimizer.zero_grad(set_to_none=True)
            losses_B.mean().backward()
            optimizer.step()
            if not torch.isfinite(losses_B).all():
                names = [
                    dataset.ids[n] for n, loss in zip(batch.numbers, losses_B, strict=True) if not loss.isfinite()
                ]
                raise UsageError(
                    f"epoch {epoch}: the loss is not finite on {names}; lower --learning-rate, or check "
                    "these meshes with meshshard verify --full"
                )
            total, seen = total + float(losses_B.detach().sum()), seen + len(batch.numbers)
            if report:
                report(Progress(epoch=epoch, meshes=seen, loss=total / seen, learning_rate=rate))

        found = evaluate(network, dataset, val_numbers, config, device, rounds=()).raw
        row = {
            "epoch": epoch,
            "loss": total / seen,
            "learning_rate": rate,
            "val_accuracy": found.accuracy(),
            "val_mean_iou": found.summary()["mean_iou"],
            "seconds": round(time.perf_counter() - start, 3),
        }
        history.append(row)
        state = Checkpoint(
            tensors={f"net.{name}": tensor for name, tensor in network.state_dict().items()},
            config=config,
            classes=dataset.classes,
            recipe=dataset.recipe,
            splits_sha256=dataset.index.splits_sha256,
            content_sha256=dataset.index.content_sha256,
            state={
                "epoch": epoch,
                "val_accuracy": row["val_accuracy"],
                "folder": str(dataset.folder.resolve()),
                "algorithm_version": dataset.index.algorithm_version,
            },
        )
        if row["val_accuracy"] > best:
            best = row["val_accuracy"]
            checkpoint.save(run / BEST, state)
        _save_last(run, state, optimizer, history)
        publish(run / METRICS, "".join(json.dumps(line) + "\n" for line in history).encode())
        if report:
            report(Progress(epoch=epoch, meshes=seen, loss=row["loss"], learning_rate=rate, metrics=row))
    return history


def learning_rate(config: TrainConfig, epoch: float) -> float:
    """Linear warm-up from a thousandth, for at most a third of the schedule, then a cosine to 0 at the last epoch.
    `epoch` counts in fractions."""
    warmup = min(config.warmup_epochs, config.epochs / 3)
    if epoch < warmup:
        return config.learning_rate * (1e-3 + (1 - 1e-3) * epoch / warmup)
    return config.learning_rate * 0.5 * (1 + math.cos(math.pi * (epoch - warmup) / (config.epochs - warmup)))


def _split(dataset: Dataset, name: str) -> Sequence[int]:
    numbers = dataset.splits.get(name, ())
    if not numbers:
        there = ", ".join(f"{split or '(none)'}: {len(members)}" for split, members in dataset.splits.items())
        raise UsageError(
            f"{dataset.folder} has no meshes in the split {name!r} ({there}); training needs train and val. "
            "Meshes in a folder train/ are for training, or those that [splits] of the data set's TOML file names or "
            "draws (docs/datasets.md); part of train becomes val: meshshard features --val-fraction"
        )
    return numbers


def _save_last(run: Path, state: Checkpoint, optimizer: torch.optim.AdamW, history: list[dict[str, Any]]) -> None:
    moments: dict[str, torch.Tensor] = {}
    for number, slot in optimizer.state_dict()["state"].items():
        moments |= {f"opt.{number}.{name}": value for name, value in slot.items()}
    last = replace(state, tensors=state.tensors | moments, state=state.state | {"history": history})
    checkpoint.save(run / LAST, last)


def _resume(
    run: Path, dataset: Dataset, config: TrainConfig, network: TaskDrivenNet, optimizer: torch.optim.AdamW
) -> list[dict[str, Any]]:
    """Load last.safetensors into network and optimiser, where there is one, and return the history so far."""
    if not (run / LAST).exists():
        return []
    try:
        before = checkpoint.load(run / LAST)
    except UsageError as error:
        raise UsageError(f"{error}; delete {run} to start anew, or choose another --run") from error
    clashes = before.config.differences(config) + before.other_data(dataset)
    if clashes:
        raise UsageError(f"{run} holds a run with other settings; choose another --run. " + "; ".join(clashes))
    network.load_state_dict({k.removeprefix("net."): v for k, v in before.tensors.items() if k.startswith("net.")})
    slots: dict[int, dict[str, torch.Tensor]] = {}
    for name, tensor in before.tensors.items():
        if name.startswith("opt."):
            _, number, part = name.split(".")
            slots.setdefault(int(number), {})[part] = tensor
    optimizer.load_state_dict({"state": slots, "param_groups": optimizer.state_dict()["param_groups"]})
    history: list[dict[str, Any]] = before.state["history"]
    return history
