"""The two layouts of MeshCNN's archives, which most of the field's data sets come in."""

from collections.abc import Callable
from pathlib import Path

from meshshard.errors import UsageError
from meshshard.mesh_files import MESH_SUFFIXES
from meshshard_prep.datasets.layout import SPLITS, Entry, LabelFile, RawDataset
from meshshard_prep.datasets.told import lacking, not_read
from meshshard_prep.labels import class_table


def read_segmentation(
    root: Path,
    *,
    name: str = "",
    classes: tuple[str, ...] = (),
    first_value: int | None = None,
    domains: tuple[str, ...] = ("face", "edge"),
    group_of: Callable[[str], str] | None = None,
) -> RawDataset:
    """`{train,test}/*.obj` with `seg/*.eseg` (or `.seg`): one integer for each edge, or for each face.

    `first_value` is the integer of the first class; without it classes are the distinct integers of the files.
    """
    found = [(split, path, _label_file(root, path)) for split in SPLITS for path in mesh_files(root / split)]
    if not found:
        raise UsageError(f"{root} is not in MeshCNN's segmentation layout: no meshes in {root / 'train'} or test/")
    if first_value is None:
        files = [LabelFile(path=label) for _, _, label in found if label.is_file()]
        classes, table = class_table(files, classes, root)
    else:
        table = {first_value + number: number for number in range(len(classes))}
    entries = [
        Entry(
            id=f"{split}/{path.stem}",
            path=path,
            source=f"{split}/{path.name}",
            split=split,
            group=group_of(path.stem) if group_of else "",
            labels=LabelFile(path=label, classes=table, domains=domains),
        )
        for split, path, label in found
    ]
    return RawDataset(
        name=name or root.resolve().name,
        task="segmentation",
        classes=classes,
        entries=tuple(entries),
        notes=not_read(root, entries),
    )


def read_classification(root: Path, *, name: str = "", classes: tuple[str, ...] = ()) -> RawDataset:
    """`<class>/{train,test}/*.obj`: the folder is the class; classes in alphabetical order.

    `classes`: those that are published, where they are known: one that is not there keeps its number, and is told.
    """
    there = sorted(p.name for p in root.iterdir() if any((p / split).is_dir() for split in SPLITS))
    known = classes or tuple(there)
    entries = [
        Entry(
            id=f"{label}/{split}/{path.stem}",
            path=path,
            source=f"{label}/{split}/{path.name}",
            split=split,
            mesh_label=number,
        )
        for number, label in enumerate(known)
        for split in SPLITS
        for path in mesh_files(root / label / split)
    ]
    if not entries:
        raise UsageError(f"{root} is not in MeshCNN's classification layout: no meshes in {root}/<class>/train")
    return RawDataset(
        name=name or root.resolve().name,
        task="classification",
        classes=known,
        entries=tuple(entries),
        notes=lacking("classes", known, there) + not_read(root, entries),
    )


def mesh_files(folder: Path) -> list[Path]:
    """Mesh files of one folder, by name; none where there is no such folder. Names that begin with a dot are passed
    over."""
    if not folder.is_dir():
        return []
    return sorted(p for p in folder.iterdir() if p.suffix.lower() in MESH_SUFFIXES and not p.name.startswith("."))


def _label_file(root: Path, mesh: Path) -> Path:
    other = root / "seg" / f"{mesh.stem}.seg"
    return other if other.is_file() else root / "seg" / f"{mesh.stem}.eseg"
