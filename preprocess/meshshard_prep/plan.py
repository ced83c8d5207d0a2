"""What a run would do: the key of every entry, and where its sample already is."""

import contextlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from meshshard.errors import InvalidMesh, InvalidShard
from meshshard.files import sha256_of
from meshshard.index import INDEX_NAME, Index, Rejection, read_index
from meshshard.reader import Shard
from meshshard.recipe import Recipe
from meshshard_prep.datasets.layout import Entry
from meshshard_prep.formats import read_file


@dataclass(frozen=True, kw_only=True)
class Job:
    """One entry with the bytes it is made of, by hash. `key` names its sample: same key, same numbers."""

    entry: Entry
    source_sha256: str
    key: str

    def names(self) -> dict[str, Any]:
        """What its sample is called. Not part of the key: taken from the entry every time a sample is packed."""
        return {
            "id": self.entry.id,
            "source": self.entry.source,
            "source_sha256": self.source_sha256,
            "split": self.entry.split,
            "group": self.entry.group,
        }


def make_job(entry: Entry, recipe: Recipe, algorithm_version: int) -> Job:
    """Read an entry's files and name its sample. InvalidMesh where a file cannot be read, or has no proper name."""
    try:
        entry.source.encode()
    except UnicodeEncodeError:
        raise InvalidMesh(
            "bad-name",
            "a file's name is UTF-8",
            f"this one is {entry.source.encode(errors='surrogateescape')!r}",
            place=printable(entry.source),
            advice="rename it",
        ) from None
    mesh, labels = read_entry(entry)
    key = key_of(entry, mesh, labels, recipe, algorithm_version)
    return Job(entry=entry, source_sha256=sha256_of(mesh), key=key)


def key_of(entry: Entry, mesh: bytes, labels: bytes | None, recipe: Recipe, algorithm_version: int) -> str:
    """Hash of all that a sample depends on: mesh and label bytes, what labels mean, recipe, algorithm version.

    Paths, times, job counts and splits are not part of it.
    """
    parts = (
        f"algorithm {algorithm_version}",
        recipe.to_json(),
        sha256_of(mesh),
        entry.path.suffix.lower(),
        sha256_of(labels) if labels is not None else "no labels",
        repr((sorted(entry.label_classes.items()), entry.label_domains, entry.mesh_label)),
    )
    return sha256_of("\n".join(parts).encode())


def read_entry(entry: Entry) -> tuple[bytes, bytes | None]:
    """The bytes of an entry's mesh file and, where it should have one, of its label file."""
    mesh = read_file(entry.path, entry.source)
    if entry.labels is None:
        return mesh, None
    if not entry.labels.exists():
        raise InvalidMesh(
            "no-labels",
            f"its label file is {entry.labels.name}",
            "there is no such file",
            place=entry.source,
            advice=f"put it at {entry.labels.parent.name}/{entry.labels.name}, or take the mesh away",
        )
    return mesh, read_file(entry.labels, entry.labels.name)


def printable(name: str) -> str:
    """A name as valid UTF-8: bytes that are none are written as \\xNN."""
    return name.encode(errors="surrogateescape").decode(errors="backslashreplace")


@dataclass(frozen=True, kw_only=True)
class Before:
    """What a folder holds already. `samples`: key -> shard and row; `refused`: (key, id, source) -> refusal, whose
    message names the file."""

    index: Index | None
    samples: dict[str, tuple[Shard, int]]
    refused: dict[tuple[str, str, str], Rejection]


def stored_before(folder: Path) -> Before:
    """The samples and refusals of earlier runs. A damaged index or shard counts as none: it is made again."""
    if not (folder / INDEX_NAME).exists():
        return Before(index=None, samples={}, refused={})
    try:
        index = read_index(folder)
    except InvalidShard:
        return Before(index=None, samples={}, refused={})
    samples: dict[str, tuple[Shard, int]] = {}
    start = 0
    for entry in index.shards:
        shard = Shard(folder / entry.file, entry.sha256)
        with contextlib.suppress(InvalidShard):
            samples |= {key: (shard, row) for row, key in enumerate(index.keys[start : start + len(shard)])}
        start += entry.meshes
    refused = {(entry.key, entry.id, entry.source): entry for entry in index.refused if entry.key}
    return Before(index=index, samples=samples, refused=refused)
