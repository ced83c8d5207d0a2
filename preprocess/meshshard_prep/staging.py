"""Samples that are computed and not yet packed, as one-mesh shards: a killed run loses only what was in flight."""

from pathlib import Path

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
    """A staged sample. InvalidShard: the file was damaged since `prepare` looked."""
    return Shard(path, sha256=path.name.split(".")[1])[0]


def clear(folder: Path) -> None:
    """Remove the staging folder, after what it held was published."""
    for path in (folder / FOLDER).glob("*"):
        path.unlink()
    (folder / FOLDER).rmdir()


def prepare(folder: Path) -> None:
    """Make the folders of a run; remove temporary files of killed ones, and staged samples that are damaged. The
    caller holds the folder's lock."""
    (folder / FOLDER).mkdir(parents=True, exist_ok=True)
    for place in (folder, folder / FOLDER):
        for path in place.glob(f"{TEMPORARY_PREFIX}*"):
            path.unlink()
    for path in staged(folder).values():
        try:
            get(path)
        except InvalidShard:
            path.unlink()
