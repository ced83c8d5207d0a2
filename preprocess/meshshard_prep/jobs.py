"""Entries to jobs: what a mesh is made of, by hash. Its key names its sample: same key, same numbers."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

from meshshard.errors import InvalidMesh
from meshshard.files import sha256_of
from meshshard.index import Rejection
from meshshard.recipe import Recipe
from meshshard.remote import RemotePath
from meshshard_prep.datasets.layout import Entry, LabelFile
from meshshard_prep.formats import read_file, sha256_of_input
from meshshard_prep.labels.written import in_order

ALGORITHM_VERSION = 3
"""Raised whenever the same mesh and recipe give other numbers; stored samples of an older one are stale."""


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


def make_job(entry: Entry, recipe: Recipe) -> Job:
    """Hash an entry's files and name its sample. InvalidMesh where a file cannot be read, or has no proper name."""
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
    mesh_sha256 = sha256_of_input(entry.path, entry.source)
    hashes = [mesh_sha256, *(None if path is None else sha256_of_input(path, path.name) for path in _others(entry))]
    entry = replace(entry, path=_whole(entry.path))
    if entry.labels is not None:
        entry = replace(entry, labels=replace(entry.labels, path=_whole(entry.labels.path)))
    if entry.correspondence is not None:
        entry = replace(entry, correspondence=_whole(entry.correspondence))
    return Job(entry=entry, source_sha256=mesh_sha256, key=key_of(entry, hashes, recipe))


def _whole(path: Path) -> Path:
    """Workers may run in another folder."""
    return path if isinstance(path, RemotePath) else path.absolute()


def key_of(entry: Entry, hashes: Sequence[str | None], recipe: Recipe) -> str:
    """Hash of all that a sample depends on: bytes of the files, what they mean, recipe, ALGORITHM_VERSION.

    `hashes`: of mesh, labels and correspondence, None where the entry has none.
    Paths, times, job counts and splits are not part of it.
    """
    mesh, labels, correspondence = hashes
    parts = [
        f"algorithm {ALGORITHM_VERSION}",
        _text_of(recipe),
        str(mesh),
        entry.path.suffix.lower(),
        labels or "no labels",
        repr((_meaning_of(entry.labels), entry.mesh_label)),
    ]
    if entry.correspondence is not None:
        parts += [f"template of {entry.template}", correspondence or "the template's own vertices"]
    if entry.deformed:
        parts.append(f"deformed copy {entry.deformed}")
    return sha256_of("\n".join(parts).encode())


def _meaning_of(labels: LabelFile | None) -> tuple[object, ...]:
    if labels is None:
        return ()
    classes = [(value, labels.classes[value]) for value in in_order(labels.classes)]
    return labels.form, labels.name, classes, labels.domains, labels.to


@cache
def _text_of(recipe: Recipe) -> str:
    return recipe.to_json()


def read_entry(entry: Entry) -> tuple[bytes, bytes | None, bytes | None]:
    """The bytes of an entry's mesh file and, where it should have them, of its label file and its correspondence."""
    mesh = read_file(entry.path, entry.source)
    labels, correspondence = (None if path is None else read_file(path, path.name) for path in _others(entry))
    return mesh, labels, correspondence


def _others(entry: Entry) -> tuple[Path | None, Path | None]:
    """The files of an entry beside its mesh."""
    return label_file(entry), correspondence_file(entry)


def label_file(entry: Entry) -> Path | None:
    """The label file of an entry, or None where it needs none. InvalidMesh: it should have one and has not."""
    if entry.labels is None:
        return None
    path = entry.labels.path
    if not path.exists():
        raise InvalidMesh(
            "no-labels",
            f"its label file is {path.name}",
            "there is no such file",
            place=entry.source,
            advice=f"put it at {path.parent.name}/{path.name}, or take the mesh away",
        )
    return path


def correspondence_file(entry: Entry) -> Path | None:
    """The file that names an entry's vertices, or None where it needs none. InvalidMesh: it should have one and has
    not."""
    path = entry.correspondence
    if path is None or path == entry.path:
        return None
    if not path.exists():
        raise InvalidMesh(
            "no-correspondence",
            f"the file that names its vertices is {path.name}",
            "there is no such file",
            place=entry.source,
            advice=f"put it at {path.parent.name}/{path.name}, or take the mesh away",
        )
    return path


def rejection(entry: Entry, code: str, message: str, key: str) -> Rejection:
    """A mesh that is not stored, with the words for the user. `key`: of its content, where the refusal rests on
    nothing else and holds until that changes."""
    return Rejection(id=printable(entry.id), source=printable(entry.source), code=code, message=message, key=key)


def printable(name: str) -> str:
    """A name as valid UTF-8: bytes that are none are written as \\xNN."""
    return name.encode(errors="surrogateescape").decode(errors="backslashreplace")
