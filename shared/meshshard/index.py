"""index.json: what a data set of shards consists of. What it does not name does not exist."""

import json
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

from meshshard.errors import InvalidShard, UsageError
from meshshard.files import publish, sha256_of
from meshshard.recipe import Recipe

INDEX_NAME = "index.json"
INDEX_FORMAT = "meshshard-index"
INDEX_VERSION = 1


@dataclass(frozen=True, kw_only=True)
class ShardEntry:
    """One shard file, by its name in the folder of the index."""

    file: str
    bytes: int
    sha256: str
    meshes: int
    vertices: int
    faces: int


@dataclass(frozen=True, kw_only=True)
class Rejection:
    """A mesh that is not stored: refused by a rule (`code` of errors.REFUSALS), or failed (code "failed")."""

    id: str
    source: str
    code: str
    message: str
    key: str


@dataclass(frozen=True, kw_only=True)
class Index:
    """The content of index.json. Samples are in the order of the shards; `split` is the one to train with:
    as shipped, with a validation split drawn from train where none was shipped."""

    dataset: str
    task: str
    classes: tuple[str, ...]
    recipe: Recipe
    algorithm_version: int
    shards: tuple[ShardEntry, ...]
    ids: tuple[str, ...]
    keys: tuple[str, ...]
    splits: tuple[str, ...]
    split_seed: int
    val_fraction: float
    refused: tuple[Rejection, ...] = ()
    failed: tuple[Rejection, ...] = ()

    @property
    def splits_sha256(self) -> str:
        """One hash for who is in which split: results with the same hash are comparable."""
        pairs = sorted(zip(self.ids, self.splits, strict=True))
        return sha256_of("".join(f"{name}\t{split}\n" for name, split in pairs).encode())

    @property
    def content_sha256(self) -> str:
        """One hash for what every sample was computed from: meshes, labels, recipe, algorithm version."""
        pairs = sorted(zip(self.ids, self.keys, strict=True))
        return sha256_of("".join(f"{name}\t{key}\n" for name, key in pairs).encode())

    def to_bytes(self) -> bytes:
        """The file, with a sha256 over all of it but that line."""
        table: dict[str, Any] = {"format": INDEX_FORMAT, "format_version": INDEX_VERSION}
        table |= {f.name: getattr(self, f.name) for f in fields(self)}
        table |= {"recipe": json.loads(self.recipe.to_json()), "splits_sha256": self.splits_sha256}
        for name in ("shards", "refused", "failed"):
            table[name] = [asdict(entry) for entry in table[name]]
        table["sha256"] = _sealed(table)
        return json.dumps(table, indent=1, ensure_ascii=False).encode() + b"\n"

    def write(self, folder: Path) -> None:
        """Publish as folder/index.json."""
        publish(folder / INDEX_NAME, self.to_bytes())


def read_index(folder: Path) -> Index:
    """The index of a folder of shards. UsageError where there is none, InvalidShard where it is damaged."""
    path = folder / INDEX_NAME
    try:
        text = path.read_bytes()
    except FileNotFoundError:
        raise UsageError(
            f"{folder} holds no {INDEX_NAME}: it is no folder of shards; "
            "`meshshard features DATASET --out FOLDER` makes one"
        ) from None
    except OSError as error:
        raise UsageError(f"{path} cannot be read: {error.strerror}") from error
    try:
        table = json.loads(text)
        seal = table.pop("sha256")
    except (ValueError, KeyError, AttributeError, TypeError) as error:
        raise InvalidShard(
            f"{path}: not the index of a meshshard folder, or damaged ({error}); run meshshard features again"
        ) from error
    if (table.get("format"), table.get("format_version")) != (INDEX_FORMAT, INDEX_VERSION):
        raise InvalidShard(
            f"{path}: format {table.get('format')!r} version {table.get('format_version')!r}; "
            f"this meshshard reads {INDEX_FORMAT!r} version {INDEX_VERSION}"
        )
    if _sealed(table) != seal:
        raise InvalidShard(f"{path}: the index is damaged: its content does not match its sha256 {seal}")
    try:
        return _from_table(table)
    except (KeyError, TypeError) as error:
        raise InvalidShard(f"{path}: a part of the index is missing or of another kind: {error!r}") from error


def _sealed(table: dict[str, Any]) -> str:
    return sha256_of(json.dumps(table, sort_keys=True, separators=(",", ":")).encode())


def _from_table(table: dict[str, Any]) -> Index:
    values = {f.name: table[f.name] for f in fields(Index)}
    values["recipe"] = Recipe.from_table(table["recipe"], INDEX_NAME)
    values["shards"] = tuple(ShardEntry(**entry) for entry in table["shards"])
    for name in ("refused", "failed"):
        values[name] = tuple(Rejection(**entry) for entry in table[name])
    for name in ("classes", "ids", "keys", "splits"):
        values[name] = tuple(table[name])
    return Index(**values)
