"""What an adapter says about a raw data set: which files belong together, what the labels mean."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from meshshard.splits import SPLITS
from meshshard_prep.labels.label_file import DOMAINS, LabelFile

__all__ = ["DOMAINS", "SPLITS", "Adapter", "Draw", "Entry", "LabelFile", "RawDataset", "without_labels"]


@dataclass(frozen=True, kw_only=True)
class Entry:
    """One mesh of a data set.

    `source`: its path below the raw folder. `split`: as shipped, "" for none. `group`: the subject or sequence it
    belongs to, "" for none known. `mesh_label`: class of the whole mesh, -1 for none. `labels`: of its parts.
    `correspondence`: the file that names its vertex for each vertex of a template, 1-based, a line each; the mesh
    file itself where the mesh has the template's own vertices, in its order. `template`: how many vertices that has.
    `deformed`: 0 for the mesh as it is, or which of its deformed copies this is.
    """

    id: str
    path: Path
    source: str
    split: str = ""
    group: str = ""
    mesh_label: int = -1
    labels: LabelFile | None = None
    correspondence: Path | None = None
    template: int = 0
    deformed: int = 0


@dataclass(frozen=True, kw_only=True)
class RawDataset:
    """A raw data set as found in its folder.

    `task`: "segmentation", "classification", "correspondence" or "unlabelled". `colours`: hexadecimal, one a class,
    or none. `folds`: id -> fold, where folds are shipped. `drawn`: id -> split, where splits are other than the
    entries' own; `split_rule` says how. `notes`: what is missing or odd, as sentences for the user.
    """

    name: str
    task: str
    classes: tuple[str, ...]
    entries: tuple[Entry, ...]
    colours: tuple[str, ...] = ()
    licence: str = ""
    citation: str = ""
    folds: Mapping[str, int] = field(default_factory=dict)
    drawn: Mapping[str, str] | None = None
    split_rule: str = "as shipped"
    notes: tuple[str, ...] = ()

    @property
    def splits(self) -> dict[str, str]:
        """Id -> split: as drawn, or as shipped."""
        return {entry.id: entry.split for entry in self.entries} if self.drawn is None else dict(self.drawn)


def without_labels(dataset: RawDataset) -> RawDataset:
    """The meshes alone."""
    entries = tuple(Entry(id=entry.id, path=entry.path, source=entry.source) for entry in dataset.entries)
    return replace(
        dataset, task="unlabelled", classes=(), colours=(), entries=entries, drawn=None, split_rule="as shipped"
    )


@dataclass(frozen=True, kw_only=True)
class Draw:
    """Which of its possible splits a data set shall have: drawn by `seed`, or the one that tests on fold `fold`."""

    seed: int = 0
    fold: int = 0


@dataclass(frozen=True, kw_only=True)
class Adapter:
    """A data set that is known by name.

    `page`: of docs/datasets, which describes it. `read` takes the raw folder; `task` is that of what it gives.
    `generate`, where there is one, makes what `is_complete` misses in it. `split`, where splits are not shipped,
    gives them. `expected`: number of meshes of each split (as shipped, "" for none), and "classes" where folders are
    the classes; what differs is told. `folder`: name of its raw folder, where that is shared with other data sets.
    """

    name: str
    page: str
    summary: str
    licence: str
    citation: str
    origin: str
    read: Callable[[Path], RawDataset]
    task: str = "segmentation"
    generate: Callable[[Path], None] | None = None
    is_complete: Callable[[Path], bool] = Path.is_dir
    split: Callable[[RawDataset, Draw], RawDataset] | None = None
    expected: Mapping[str, int] = field(default_factory=dict)
    folder: str = ""
