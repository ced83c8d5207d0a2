"""Checkpoints: one safetensors file with everything needed to use the network, and a sha256 over all of it."""

import contextlib
import json
import re
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import safetensors
import safetensors.torch
import torch

from meshshard import Dataset
from meshshard.errors import UsageError
from meshshard.files import open_regular, publish, sha256_of, sync_folder, temporary_beside
from meshshard.recipe import Recipe
from meshshard_train.config import TrainConfig
from meshshard_train.inputs import input_size
from meshshard_train.model import TaskDrivenNet

FORMAT = "meshshard-checkpoint-1"


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
        made, learned = dataset.index.algorithm_version, self.state["algorithm_version"]
        if made != learned:
            lines.append(f"algorithm version: {learned} against {made}")
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
        """The network with these weights, in evaluation mode. UsageError: they are those of another network."""
        network = network_for(self.config, len(self.recipe.times), len(self.classes))
        weights = {k.removeprefix("net."): v for k, v in self.tensors.items() if k.startswith("net.")}
        try:
            network.load_state_dict(weights)
        except RuntimeError as error:
            why = " ".join(str(error).split())
            raise UsageError(
                f"the checkpoint's weights do not fit its network ({why}): another version wrote it; train anew, "
                "or install that version"
            ) from error
        return network.eval()


def network_for(config: TrainConfig, times: int, classes: int) -> TaskDrivenNet:
    """A new network: a class, or a functional coordinate, an output."""
    outputs = config.coordinates if config.task == "correspondence" else classes
    return TaskDrivenNet(input_size(config, times), outputs, config.normalisation, config.backbone, config.width)


def previous(path: Path) -> Path:
    """Where the checkpoint is that `save` replaced last."""
    return path.with_name(f"previous-{path.name}")


SEAL = re.compile(rb'"sha256":"([0-9a-f]{64})"')
UNSEALED = "0" * 64


def save(path: Path, checkpoint: Checkpoint) -> None:
    """Publish a checkpoint, and keep the one before as `previous(path)`. A file with the same content is left alone.

    Killed at any moment, it leaves the old file or the new one of that name, or none and the old one as the previous;
    never a part. UsageError: it cannot be written, a full disk say; then what was there stays.
    """
    metadata = {
        "format": FORMAT,
        "config": checkpoint.config.to_json(),
        "features": json.dumps(list(checkpoint.config.features)),
        "classes": json.dumps(list(checkpoint.classes)),
        "recipe": checkpoint.recipe.to_json(),
        "splits_sha256": checkpoint.splits_sha256,
        "content_sha256": checkpoint.content_sha256,
        "state": json.dumps(checkpoint.state),
        "sha256": UNSEALED,
    }
    tensors = {name: tensor.detach().cpu().contiguous() for name, tensor in checkpoint.tensors.items()}
    file = sealed(ordered(safetensors.torch.save(tensors, metadata)))
    if path.exists() and path.stat().st_size == len(file) and path.read_bytes() == file:
        return
    with told_to_make_room(path, len(file)):
        fresh = temporary_beside(path)
        publish(fresh, file)
        if path.exists():
            path.replace(previous(path))
        fresh.replace(path)
        sync_folder(path.parent)


@contextlib.contextmanager
def told_to_make_room(path: Path, size: int) -> Iterator[None]:
    """Errors of writing a file of `size` bytes become UsageError: what was not written, and what to do."""
    try:
        yield
    except OSError as error:
        free = shutil.disk_usage(path.parent).free
        raise UsageError(
            f"{path} cannot be written: {error.strerror}; it takes {size / 1e6:.1f} MB, and {free / 1e6:.1f} MB are "
            f"free in {path.parent}. What was saved before is whole: make room, and the same command goes on from it"
        ) from error


def ordered(file: bytes) -> bytes:
    """A safetensors file with its header's keys sorted: the library writes them in another order each time."""
    size = int.from_bytes(file[:8], "little")
    header = json.dumps(json.loads(file[8 : 8 + size]), sort_keys=True, separators=(",", ":")).encode()
    header += b" " * (-len(header) % 8)
    return len(header).to_bytes(8, "little") + header + file[8 + size :]


def sealed(file: bytes) -> bytes:
    """A safetensors file with the sha256 that it has with zeros in the place of it. UsageError: it has no place."""
    place = SEAL.search(file)
    if place is None:
        raise UsageError("no meshshard checkpoint: its metadata has no sha256")
    start, end = place.span(1)
    digest = sha256_of(file[:start] + UNSEALED.encode() + file[end:])
    return file[:start] + digest.encode() + file[end:]


def load(path: Path) -> Checkpoint:
    """Read and check a checkpoint; nothing of it is parsed before its hash is right. UsageError: not there, not one
    of ours, or damaged."""
    try:
        with open_regular(path) as stream:
            file = stream.read()
    except FileNotFoundError:
        seeds = sorted(path.parent.glob(f"seed-*/{path.name}"))
        advice = (
            f"name the run of one seed, as {seeds[0].parent}" if seeds else "train first: meshshard train DATASET"
        )
        raise UsageError(f"{path} is not there; {advice}") from None
    except OSError as error:
        raise UsageError(f"{path} cannot be read: {error.strerror}") from error
    try:
        if sealed(file) != file:
            raise UsageError("its content does not have the sha256 that it says: it is damaged")
        return _parsed(file)
    except UsageError as error:
        raise UsageError(f"{path} is no checkpoint that can be used: {error}{older(path)}") from error
    except (safetensors.SafetensorError, ValueError, KeyError, TypeError, RecursionError, OverflowError) as error:
        raise UsageError(f"{path} is no checkpoint that can be used: {error!r}{older(path)}") from error


def older(path: Path) -> str:
    """What to type where a checkpoint cannot be used, and the one before is there; else nothing."""
    return f"; take the one before: mv {previous(path)} {path}" if previous(path).exists() else ""


def _parsed(file: bytes) -> Checkpoint:
    header = json.loads(file[8 : 8 + int.from_bytes(file[:8], "little")])
    metadata = header["__metadata__"]
    if metadata["format"] != FORMAT:
        raise UsageError(f"its format is {metadata['format']!r}, not {FORMAT!r}")
    return Checkpoint(
        tensors=safetensors.torch.load(file),
        config=TrainConfig.from_json(metadata["config"]),
        classes=tuple(json.loads(metadata["classes"])),
        recipe=Recipe.from_json(metadata["recipe"]),
        splits_sha256=metadata["splits_sha256"],
        content_sha256=metadata["content_sha256"],
        state=json.loads(metadata["state"]),
    )
