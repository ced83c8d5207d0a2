"""What the names of folders say: classes, and sets that stand side by side."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import PurePosixPath

from meshshard_prep.datasets.folder import SPLIT_FOLDERS
from meshshard_prep.datasets.layout import Entry
from meshshard_prep.datasets.own.mesh_labels import FOLDER, TOP_FOLDER, class_folder


@dataclass(frozen=True, kw_only=True)
class ClassFolders:
    """`meshes`: folder that may be a class -> its meshes. `which`: "folder", the nearest to a mesh, or "top folder".
    `sure`: splits are laid out by class, and so nothing else can be meant. `outermost`: with "folder", the outermost
    folders where these may be the classes instead, else none."""

    meshes: Mapping[str, int]
    which: str
    sure: bool
    outermost: tuple[str, ...] = ()


def class_folders(entries: Sequence[Entry]) -> ClassFolders | None:
    """The folders as classes, the nearest if they can be, else the outermost; None where a mesh is in no folder, all
    are in one, or most have one of their own."""
    nearest, outermost = _class_folders(entries, FOLDER), _class_folders(entries, TOP_FOLDER)
    if nearest and outermost and outermost.meshes != nearest.meshes and not nearest.sure:
        return replace(nearest, outermost=tuple(outermost.meshes))
    return nearest or outermost


def _class_folders(entries: Sequence[Entry], which: str) -> ClassFolders | None:
    splits: dict[str, set[str]] = defaultdict(set)
    meshes: dict[str, int] = defaultdict(int)
    for entry in entries:
        name = class_folder(entry.source, which)
        meshes[name] += 1
        splits[name].add(entry.split)
    if "" in meshes or len(meshes) < 2 or 2 * len(meshes) > len(entries):
        return None
    named = [found for found in splits.values() if len(found) > 1]
    return ClassFolders(meshes=dict(sorted(meshes.items())), which=which, sure=len(named) * 2 > len(splits))


def sets_of(label_files: Mapping[str, str]) -> tuple[str, ...]:
    """Top folders that each hold meshes and, in another folder, their labels: data sets side by side, whose labels
    need not mean the same. `label_files`: mesh -> its label file. None, or two or more."""
    tops = set()
    for mesh, file in label_files.items():
        place, other = PurePosixPath(mesh).parts, PurePosixPath(file).parts
        if len(place) < 3 or place[0] != other[0] or place[:-1] == other[:-1] or place[0].lower() in SPLIT_FOLDERS:
            return ()
        tops.add(place[0])
    return tuple(sorted(tops)) if len(tops) > 1 else ()
