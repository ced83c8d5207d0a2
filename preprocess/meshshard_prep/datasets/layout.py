"""What an adapter says about a raw data set: which files belong together, what the labels mean."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

SPLITS = ("train", "val", "test")
"""Names of the folders that are splits."""

DOMAINS = ("face", "edge", "vertex")
"""What a label file may count."""


@dataclass(frozen=True, kw_only=True)
class Entry:
    """One mesh of a data set.

    `source`: its path below the raw folder. `split`: as shipped, "" for none. `group`: the subject or sequence it
    belongs to, "" for none known. `mesh_label`: class of the whole mesh, -1 for none. `labels`: its label file;
    `label_classes`: integer in that file -> class index; `label_domains`: what the file may count, of "face",
    "edge", "vertex".
    """

    id: str
    path: Path
    source: str
    split: str = ""
    group: str = ""
    mesh_label: int = -1
    labels: Path | None = None
    label_classes: Mapping[int, int] = field(default_factory=dict)
    label_domains: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class RawDataset:
    """A raw data set as found in its folder. `task`: "segmentation", "classification" or "unlabelled"."""

    name: str
    task: str
    classes: tuple[str, ...]
    entries: tuple[Entry, ...]


def without_labels(dataset: RawDataset) -> RawDataset:
    """The meshes alone."""
    entries = [Entry(id=entry.id, path=entry.path, source=entry.source) for entry in dataset.entries]
    return RawDataset(name=dataset.name, task="unlabelled", classes=(), entries=tuple(entries))


@dataclass(frozen=True, kw_only=True)
class Adapter:
    """A data set that is known by name. `read` takes the raw folder; `generate`, where there is one, makes what
    `is_complete` misses in it."""

    name: str
    summary: str
    licence: str
    citation: str
    origin: str
    read: Callable[[Path], RawDataset]
    generate: Callable[[Path], None] | None = None
    is_complete: Callable[[Path], bool] = Path.is_dir
