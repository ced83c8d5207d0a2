"""Samples that are computed and not yet packed, as one-mesh shards: a killed run loses only what was in flight."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from meshshard.errors import InvalidShard
from meshshard.files import TEMPORARY_PREFIX, publish, sha256_of
from meshshard.reader import Shard
from meshshard.recipe import Recipe
from meshshard.sample import Sample
from meshshard.writer import shard_image

FOLDER = ".staging"


def put(folder: Path, sample: Sample, recipe: Recipe, algorithm_version: int, classes: tuple[str, ...]) -> None:
    """Store a sample under its key. Its file's sha256 is in the name, so damage is noticed on the way back."""
    image = shard_image([sample], recipe=recipe, algorithm_version=algorithm_version, classes=classes)
    publish(folder / FOLDER / f"{sample.key}.{sha256_of(image)}.h5", image)


def staged(folder: Path) -> dict[str, Path]:
    """Key -> file of what an unfinished run left."""
    return {path.name.split(".")[0]: path for path in (folder / FOLDER).glob("[!.]*.h5")}


def get(path: Path) -> Sample:
    """A staged sample, in memory: hundreds are held while a shard is packed, and each map would hold its file open.
    InvalidShard: the file was damaged since `prepare` looked."""
    sample = Shard(path, sha256=path.name.split(".")[1])[0]
    arrays: dict[str, Any] = {
        name: value.copy() for name, value in vars(sample).items() if isinstance(value, np.ndarray)
    }
    return replace(sample, **arrays)


def clear(folder: Path) -> None:
    """Remove the staging folder, after what it held was published."""
    for path in (folder / FOLDER).glob("*"):
        path.unlink()
    (folder / FOLDER).rmdir()


def prepare(folder: Path) -> None:
    """Make the staging folder; remove from it what killed runs left unfinished, and samples that are damaged."""
    (folder / FOLDER).mkdir(parents=True, exist_ok=True)
    for path in (folder / FOLDER).glob(f"{TEMPORARY_PREFIX}*"):
        path.unlink()
    for path in staged(folder).values():
        try:
            get(path)
        except InvalidShard:
            path.unlink()
