"""Any folder of meshes. A label file may lie beside each mesh; folders train/, val/ and test/ are splits."""

import os
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from meshshard.errors import UsageError
from meshshard.mesh_files import MESH_SUFFIXES, mesh_files_below
from meshshard_prep.datasets.layout import Entry, LabelFile, RawDataset
from meshshard_prep.labels import class_table

LONGEST_NAME = 255
"""Bytes of a file's name, on the file systems in use."""

SPLIT_FOLDERS = {
    **{"train": "train", "training": "train"},
    **{"val": "val", "valid": "val", "validation": "val"},
    **{"test": "test", "testing": "test"},
}
"""Folder, in small letters -> the split of the meshes below it."""

LABEL_SUFFIXES = (".seg", ".eseg", ".labels", ".txt")


def read_folder(root: Path) -> RawDataset:
    """Every mesh file below `root`. As soon as one mesh has a label file of its name beside it, all need one.

    Classes are the distinct integers of the label files, rising. A single mesh file instead of a folder is a data
    set of one.
    """
    single = root.is_file()
    entries = mesh_entries(root)
    beside = {} if single else {entry.path: found for entry in entries if (found := labels_beside(entry.path))}
    classes, table = class_table([LabelFile(path=found) for found in beside.values()], (), root)
    if beside:
        missing = LABEL_SUFFIXES[0]
        entries = tuple(
            replace(
                entry,
                labels=LabelFile(path=beside.get(entry.path, entry.path.with_suffix(missing)), classes=table),
            )
            for entry in entries
        )
    return RawDataset(
        name=root.stem if single else root.resolve().name,
        task="segmentation" if beside else "unlabelled",
        classes=classes,
        entries=entries,
    )


def mesh_entries(root: Path) -> tuple[Entry, ...]:
    """Every mesh file below `root`, or `root` itself if it is one, without labels. UsageError where there is none.

    Files and folders whose name begins with a dot are passed over; links to files are followed, links to folders not.
    The split is that of the first folder on the way which is named like one; there is none without train or test.
    """
    single = root.is_file()
    paths = [root] if single else sorted(mesh_files_below(root))
    base = root.parent if single else root
    if not paths:
        raise UsageError(f"{root} holds no mesh: no file ends in {', '.join(MESH_SUFFIXES)}")
    sources = [path.relative_to(base) for path in paths]
    stems = [source.with_suffix("").as_posix() for source in sources]
    of_stem = Counter(stems)
    splits = [split_of(source.parts[:-1]) for source in sources]
    if not {"train", "test"} & set(splits):
        splits = [""] * len(splits)  # a folder called valid may hold valid meshes
    return tuple(
        Entry(
            id=stem if of_stem[stem] == 1 else source.as_posix(),
            path=path,
            source=source.as_posix(),
            split=split,
        )
        for path, source, stem, split in zip(paths, sources, stems, splits, strict=True)
    )


def split_of(folders: Sequence[str]) -> str:
    """The split that the first of the folders names which names one, or empty."""
    return next((SPLIT_FOLDERS[name.lower()] for name in folders if name.lower() in SPLIT_FOLDERS), "")


def labels_beside(path: Path) -> Path | None:
    """The label file of a mesh's name in its folder, or None; UsageError where there are two."""
    longest = max(LABEL_SUFFIXES, key=len)
    if len(os.fsencode(path.stem)) + len(longest) > LONGEST_NAME:
        return None  # the system would not even look
    found = [path.with_suffix(suffix) for suffix in LABEL_SUFFIXES if path.with_suffix(suffix).is_file()]
    if len(found) > 1:
        raise UsageError(f"{path} has two label files: {found[0].name} and {found[1].name}; keep one")
    return found[0] if found else None
