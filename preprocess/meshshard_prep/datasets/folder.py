"""Any folder of meshes. A label file may lie beside each mesh; train/, val/ and test/ on top are splits."""

import os
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from meshshard.errors import UsageError
from meshshard_prep.datasets.layout import DOMAINS, SPLITS, Entry, LabelFile, RawDataset
from meshshard_prep.formats import MESH_SUFFIXES
from meshshard_prep.labels import class_table

LONGEST_NAME = 255
"""Bytes of a file's name, on the file systems in use."""

LABEL_SUFFIXES = (".seg", ".eseg", ".labels", ".txt")


def read_folder(
    root: Path, *, name: str = "", classes: tuple[str, ...] = (), domains: tuple[str, ...] = DOMAINS
) -> RawDataset:
    """Every mesh file below `root`. As soon as one mesh has a label file of its name beside it, all need one.

    Files and folders whose name begins with a dot are passed over; links to files are followed, links to folders not.
    Classes are the distinct integers of the label files, rising; `classes` names them. A single mesh file instead
    of a folder is a data set of one.
    """
    single = root.is_file()
    paths = [root] if single else sorted(mesh_files_below(root))
    base = root.parent if single else root
    if not paths:
        raise UsageError(f"{root} holds no mesh: no file ends in {', '.join(MESH_SUFFIXES)}")
    beside = {} if single else {path: found for path in paths if (found := labels_beside(path))}
    names, table = class_table([LabelFile(path=found) for found in beside.values()], classes, root)
    stems = [path.relative_to(base).with_suffix("").as_posix() for path in paths]
    of_stem = Counter(stems)
    entries = []
    for path, stem in zip(paths, stems, strict=True):
        source = path.relative_to(base).as_posix()
        top = source.split("/")[0]
        entries.append(
            Entry(
                id=stem if of_stem[stem] == 1 else source,
                path=path,
                source=source,
                split=top if top in SPLITS and top != source else "",
                labels=LabelFile(
                    path=beside.get(path, path.with_suffix(LABEL_SUFFIXES[0])), classes=table, domains=domains
                )
                if beside
                else None,
            )
        )
    return RawDataset(
        name=name or (root.stem if single else root.resolve().name),
        task="segmentation" if beside else "unlabelled",
        classes=names,
        entries=tuple(entries),
    )


def mesh_files_below(folder: Path) -> Iterator[Path]:
    """What is no folder and ends like a mesh. A folder that cannot be listed is an OSError: it may hold meshes."""
    for path in folder.iterdir():
        if path.name.startswith("."):
            continue
        if path.is_dir():
            if not path.is_symlink():
                yield from mesh_files_below(path)
        elif path.suffix.lower() in MESH_SUFFIXES:
            yield path


def labels_beside(path: Path) -> Path | None:
    """The label file of a mesh's name in its folder, or None; UsageError where there are two."""
    longest = max(LABEL_SUFFIXES, key=len)
    if len(os.fsencode(path.stem)) + len(longest) > LONGEST_NAME:
        return None  # the system would not even look
    found = [path.with_suffix(suffix) for suffix in LABEL_SUFFIXES if path.with_suffix(suffix).is_file()]
    if len(found) > 1:
        raise UsageError(f"{path} has two label files: {found[0].name} and {found[1].name}; keep one")
    return found[0] if found else None
