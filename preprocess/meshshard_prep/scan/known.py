"""Whether a folder is one of the data sets that are known by name."""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from meshshard.errors import MeshshardError
from meshshard_prep.datasets import ADAPTERS, Adapter
from meshshard_prep.datasets.layout import Entry, RawDataset


def known_as(root: Path, entries: Sequence[Entry]) -> tuple[str, str]:
    """Name of the data set that has this layout and these numbers of meshes, or empty; and, if so, of the only one
    that has this layout and other numbers: the folder may be a part of it."""
    for adapter in ADAPTERS.values():
        expected = _meshes(adapter)
        if sum(expected.values()) == len(entries):
            found = _read(adapter, root, entries)
            if found and Counter(entry.split for entry in found.entries) == expected:
                return adapter.name, ""
    like: list[str] = []
    for adapter in ADAPTERS.values():
        if _read(adapter, root, entries):
            like.append(adapter.name)
        if len(like) > 1:
            return "", ""  # a layout that many have says nothing
    return "", like[0] if like else ""


def meshes_of(name: str) -> int:
    """How many meshes a known data set has."""
    return sum(_meshes(ADAPTERS[name]).values())


def _meshes(adapter: Adapter) -> dict[str, int]:
    return {what: count for what, count in adapter.expected.items() if what != "classes"}


def _read(adapter: Adapter, root: Path, entries: Sequence[Entry]) -> RawDataset | None:
    """The folder as that data set; None where it lacks its layout, a label file, or has meshes in other places."""
    try:
        found = adapter.read(root)
    except (MeshshardError, OSError):
        return None
    labels = [entry.labels.path for entry in found.entries if entry.labels]
    return found if len(found.entries) == len(entries) and all(path.is_file() for path in labels) else None
