"""index.json: what a data set of shards consists of. What it does not name does not exist."""

import json
import re
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

from meshshard.errors import InvalidShard, UsageError
from meshshard.files import open_regular, publish, sha256_of
from meshshard.recipe import Recipe

INDEX_NAME = "index.json"
INDEX_FORMAT = "meshshard-index"
INDEX_VERSION = 1
TASKS = ("segmentation", "classification", "correspondence", "unlabelled")
MAX_BYTES = 2**30
"""Of an index: some millions of samples."""

COLOUR = re.compile(r"#[0-9A-Fa-f]{6}")
FILE_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]*\.h5")


@dataclass(frozen=True, kw_only=True)
class ShardEntry:
    """One shard file, by its name in the folder of the index. `vertex_counts`: of its meshes, in order; here, so
    that batches are planned without opening a shard. `faces`: of all of them."""

    file: str
    bytes: int
    sha256: str
    vertex_counts: tuple[int, ...]
    faces: int

    @property
    def meshes(self) -> int:
        """How many meshes it holds."""
        return len(self.vertex_counts)

    @property
    def vertices(self) -> int:
        """Vertices of all its meshes."""
        return sum(self.vertex_counts)


@dataclass(frozen=True, kw_only=True)
class Rejection:
    """A mesh that is not stored: refused by a rule or failed: `code` of errors.REFUSALS or FAILURES."""

    id: str
    source: str
    code: str
    message: str
    key: str


@dataclass(frozen=True, kw_only=True)
class Index:
    """The content of index.json. Samples are in the order of the shards; `split` is the one to train with:
    by `split_rule`, with a validation split drawn from train where it gives none. `colours`: hexadecimal, one a
    class, or none; `notes`: what whoever uses the data set should know, such as meshes that are missing."""

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
    train_fraction: float = 1.0
    split_rule: str = "as shipped"
    licence: str = ""
    citation: str = ""
    colours: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
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
        """The file: a line for each part, the last one a sha256 of all before it."""
        table: dict[str, Any] = {"format": INDEX_FORMAT, "format_version": INDEX_VERSION}
        table |= {f.name: getattr(self, f.name) for f in fields(self)}
        table |= {"recipe": json.loads(self.recipe.to_json()), "splits_sha256": self.splits_sha256}
        for name in ("shards", "refused", "failed"):
            table[name] = [asdict(entry) for entry in table[name]]
        lines = (f'"{name}": {json.dumps(value, ensure_ascii=False)}' for name, value in table.items())
        return sealed(("{\n" + ",\n".join(lines)).encode())

    def write(self, folder: Path) -> None:
        """Publish as folder/index.json."""
        publish(folder / INDEX_NAME, self.to_bytes())


SEAL = b',\n"sha256": '


def sealed(body: bytes) -> bytes:
    """The bytes of an index, from all of it but its last line."""
    return body + SEAL + f'"{sha256_of(body)}"\n}}\n'.encode()


def read_index(folder: Path) -> Index:
    """The index of a folder of shards. UsageError where there is none, InvalidShard where it is damaged, or does
    not agree with itself."""
    path = folder / INDEX_NAME
    try:
        with open_regular(path) as stream:
            size = stream.seek(0, 2)
            if size > MAX_BYTES:
                raise InvalidShard(f"{path}: {size} bytes; an index has at most {MAX_BYTES}")
            stream.seek(0)
            text = stream.read()
    except FileNotFoundError:
        raise UsageError(
            f"{folder} holds no {INDEX_NAME}: it is no folder of shards; "
            "`meshshard features DATASET --out FOLDER` makes one"
        ) from None
    except OSError as error:
        raise UsageError(f"{path} cannot be read: {error.strerror}") from error
    body, seal, _ = text.rpartition(SEAL)
    if not seal:
        raise InvalidShard(f"{path}: not the index of a meshshard folder, or damaged; run meshshard features again")
    if text != sealed(body):
        raise InvalidShard(
            f"{path}: the index is damaged: its content does not match its sha256; run meshshard features again"
        )
    try:
        table = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InvalidShard(f"{path}: the index is not JSON: {error}") from error
    if (table.get("format"), table.get("format_version")) != (INDEX_FORMAT, INDEX_VERSION):
        raise InvalidShard(
            f"{path}: format {table.get('format')!r} version {table.get('format_version')!r}; "
            f"this meshshard reads {INDEX_FORMAT!r} version {INDEX_VERSION}"
        )
    try:
        index = _from_table(table)
        _check(index)
    except (KeyError, TypeError, OverflowError, UsageError) as error:
        raise InvalidShard(f"{path}: a part of the index is missing or of another kind: {error}") from error
    except InvalidShard as error:
        raise InvalidShard(f"{path}: {error}") from error
    return index


def _from_table(table: dict[str, Any]) -> Index:
    values = _values(Index, {f.name: table[f.name] for f in fields(Index)})
    values["recipe"] = Recipe.from_table(table["recipe"], INDEX_NAME)
    values["shards"] = tuple(
        ShardEntry(**_values(ShardEntry, entry) | {"vertex_counts": _all(entry, "vertex_counts", int)})
        for entry in _all(table, "shards", dict)
    )
    for name in ("refused", "failed"):
        values[name] = tuple(Rejection(**_values(Rejection, entry)) for entry in _all(table, name, dict))
    for name in ("classes", "ids", "keys", "splits", "colours", "notes"):
        values[name] = _all(table, name, str)
    return Index(**values)


def _values(kind: type[Index | ShardEntry | Rejection], table: dict[str, Any]) -> dict[str, Any]:
    """A copy of a JSON table, if it has the fields of a dataclass and plain values are of their types."""
    types = {f.name: f.type for f in fields(kind)}
    if set(table) != set(types):
        raise TypeError(f"{sorted(table)} is not {sorted(types)}")
    for name, value in table.items():
        if types[name] in (str, int, float) and type(value) is not types[name]:
            raise TypeError(f"{name!r} is {value!r}")
    return dict(table)


def _all(table: dict[str, Any], name: str, kind: type) -> tuple[Any, ...]:
    """A list of the index whose elements are all of one kind."""
    values = table[name]
    if type(values) is not list or not {type(value) for value in values} <= {kind}:
        raise TypeError(f"{name!r} is no list of {kind.__name__}")
    return tuple(values)


def _check(index: Index) -> None:
    """The parts agree with each other."""
    if index.task not in TASKS:
        raise InvalidShard(f"the task is one of {', '.join(TASKS)}, not {index.task!r}")
    if not 0 < index.train_fraction <= 1:
        raise InvalidShard(f"train_fraction is above 0 and at most 1, not {index.train_fraction}")
    if index.colours and len(index.colours) != len(index.classes):
        raise InvalidShard(f"it has {len(index.classes)} classes and {len(index.colours)} colours")
    if not all(COLOUR.fullmatch(colour) for colour in index.colours):
        raise InvalidShard(f"a colour is like #0072B2, and they are {', '.join(index.colours)}")
    if not 0 <= index.val_fraction < 1:
        raise InvalidShard(f"val_fraction is at least 0 and below 1, not {index.val_fraction}")
    for entry in index.shards:
        if not FILE_NAME.fullmatch(entry.file):
            raise InvalidShard(f"{entry.file!r} is no name of a shard: it must lie in the folder of the index")
        if min(entry.vertex_counts, default=0) < 0:
            raise InvalidShard(f"{entry.file} has a mesh with less than no vertex")
    samples, in_shards = len(index.ids), sum(entry.meshes for entry in index.shards)
    if not (samples == len(index.keys) == len(index.splits) == in_shards):
        raise InvalidShard(
            f"the index names {samples} samples, with {len(index.keys)} keys and {len(index.splits)} splits, and its "
            f"shards hold {in_shards}"
        )
    if len(set(index.ids)) != samples:
        raise InvalidShard("two samples of the index have the same id")
