"""Checkpoints: one safetensors file with everything needed to use the network, and a sha256 over all of it."""

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import safetensors
import safetensors.torch
import torch

from meshshard import Dataset
from meshshard.errors import UsageError
from meshshard.files import publish
from meshshard.recipe import Recipe
from meshshard_train.config import TrainConfig
from meshshard_train.data import input_size
from meshshard_train.model import TaskDrivenNet


@dataclass(frozen=True, kw_only=True)
class Checkpoint:
    """Tensors, and what they mean. `features` lists the input channels in order, `classes` names the outputs,
    `recipe` is how the features were computed, `state` whatever the writer wants to find again (JSON)."""

    tensors: dict[str, torch.Tensor]
    config: TrainConfig
    classes: tuple[str, ...]
    recipe: Recipe
    splits_sha256: str
    content_sha256: str
    state: dict[str, Any]

    def clashes(self, dataset: Dataset) -> list[str]:
        """One line for each thing that keeps the network from being used on a data set, with both values."""
        lines = []
        if self.classes != dataset.classes:
            lines.append(f"classes: {self.classes} against {dataset.classes}")
        if self.recipe != dataset.recipe:
            lines.append(f"feature recipe: {self.recipe.to_json()} against {dataset.recipe.to_json()}")
        return lines

    def other_data(self, dataset: Dataset) -> list[str]:
        """One line for each difference between the data of the run and a data set, with both values."""
        lines = self.clashes(dataset)
        for name in ("splits_sha256", "content_sha256"):
            mine, theirs = getattr(self, name), getattr(dataset.index, name)
            if mine != theirs:
                lines.append(f"{name}: {mine} against {theirs}")
        return lines

    def network(self) -> TaskDrivenNet:
        """The network with these weights, in evaluation mode."""
        network = TaskDrivenNet(input_size(self.config, len(self.recipe.times)), len(self.classes))
        network.load_state_dict({k.removeprefix("net."): v for k, v in self.tensors.items() if k.startswith("net.")})
        return network.eval()


def save(path: Path, checkpoint: Checkpoint) -> None:
    """Publish a checkpoint: the file of that name is the old one or the new one, never a part."""
    metadata = {
        "format": "meshshard-checkpoint-1",
        "config": checkpoint.config.to_json(),
        "features": json.dumps(list(checkpoint.config.features)),
        "classes": json.dumps(list(checkpoint.classes)),
        "recipe": checkpoint.recipe.to_json(),
        "splits_sha256": checkpoint.splits_sha256,
        "content_sha256": checkpoint.content_sha256,
        "state": json.dumps(checkpoint.state, sort_keys=True),
    }
    tensors = {name: tensor.detach().cpu().contiguous() for name, tensor in checkpoint.tensors.items()}
    metadata["sha256"] = _digest(metadata, tensors)
    publish(path, safetensors.torch.save(tensors, metadata))


def load(path: Path) -> Checkpoint:
    """Read and check a checkpoint. UsageError: not there, not one of ours, or damaged."""
    try:
        with safetensors.safe_open(path, framework="pt") as file:
            metadata = dict(file.metadata() or {})
            tensors = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118  not a dict
    except FileNotFoundError:
        raise UsageError(f"{path} is not there; train first: meshshard train DATASET") from None
    except (safetensors.SafetensorError, OSError) as error:
        raise UsageError(f"{path} is not a readable checkpoint: {error}") from error
    if metadata.get("format") != "meshshard-checkpoint-1":
        raise UsageError(f"{path} is a safetensors file, but not a meshshard checkpoint")
    promised = metadata.pop("sha256", "none")
    found = _digest(metadata, tensors)
    if found != promised:
        raise UsageError(f"{path} is damaged: its content has sha256 {found}, it says {promised}")
    return Checkpoint(
        tensors=tensors,
        config=TrainConfig.from_json(metadata["config"]),
        classes=tuple(json.loads(metadata["classes"])),
        recipe=Recipe.from_json(metadata["recipe"]),
        splits_sha256=metadata["splits_sha256"],
        content_sha256=metadata["content_sha256"],
        state=json.loads(metadata["state"]),
    )


def _digest(metadata: dict[str, str], tensors: dict[str, torch.Tensor]) -> str:
    state = hashlib.sha256(json.dumps(metadata, sort_keys=True).encode())
    for name in sorted(tensors):
        tensor = tensors[name]
        state.update(f"{name} {tensor.dtype} {tuple(tensor.shape)};".encode())
        state.update(tensor.reshape(-1).view(torch.uint8).numpy().data)
    return state.hexdigest()
