"""The key labels.mesh: one class for a whole mesh, from the name of its folder or from a list file."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path, PurePosixPath

from meshshard_prep.datasets.folder import SPLIT_FOLDERS
from meshshard_prep.datasets.layout import Entry
from meshshard_prep.datasets.own.class_list import read_class_list
from meshshard_prep.datasets.own.classes import check_once
from meshshard_prep.datasets.own.document import Document, near
from meshshard_prep.datasets.own.names import Names

FOLDER, TOP_FOLDER = "folder", "top folder"


def with_mesh_labels(
    document: Document, root: Path, entries: Sequence[Entry]
) -> tuple[tuple[str, ...], tuple[Entry, ...], tuple[str, ...]]:
    """Classes, entries with the class of their mesh, and notes. Meshes that a list does not name are left out.

    UsageError: a mesh in no folder, a list that names no mesh, a class that the file does not know.
    """
    value = document.get("labels.mesh")
    if value in (FOLDER, TOP_FOLDER):
        written, notes = _by_folder(document, entries)
    else:
        written, notes = _by_list(document, root / value, entries)
    # 10 comes after 9: integers in order, as everywhere
    values = sorted(
        set(written.values()), key=lambda text: (not text.isdecimal(), int(text) if text.isdecimal() else 0, text)
    )
    names, classes = _classes(document, values)
    labelled = tuple(
        replace(entry, mesh_label=classes[written[entry.id]]) for entry in entries if entry.id in written
    )
    return names, labelled, notes


def class_folder(source: str, which: str = FOLDER) -> str:
    """The folder nearest to a mesh that is not named like a split, or the outermost such, or empty."""
    folders = [folder for folder in PurePosixPath(source).parts[:-1] if folder.lower() not in SPLIT_FOLDERS]
    return "" if not folders else folders[0 if which == TOP_FOLDER else -1]


def _by_folder(document: Document, entries: Sequence[Entry]) -> tuple[dict[str, str], tuple[str, ...]]:
    which = document.get("labels.mesh")
    written = {entry.id: class_folder(entry.source, which) for entry in entries}
    if bare := [entry.source for entry in entries if not written[entry.id]]:
        raise document.wrong("labels.mesh", f'is "{which}", and {bare[0]} is in no folder that could be its class')
    found = len(set(written.values()))
    if 1 < len(written) == found or found == 1 < len(written):
        what = f"all meshes one class, {next(iter(written.values()))!r}" if found == 1 else "each mesh its own class"
        other = TOP_FOLDER if which == FOLDER else FOLDER
        return written, (f'{document.place("labels.mesh")}: "{which}" gives {what}; is "{other}" meant?',)
    return written, ()


def _by_list(document: Document, path: Path, entries: Sequence[Entry]) -> tuple[dict[str, str], tuple[str, ...]]:
    names = Names(entries)
    written: dict[str, str] = {}
    strange = []
    for row in read_class_list(path, document.place("labels.mesh")):
        found = names.one(row.mesh, row.place) if row.label else []
        strange += [] if found else [row]
        for entry in found:
            if written.setdefault(entry.id, row.label) != row.label:
                rule = f"gives {entry.id!r} two classes: {written[entry.id]!r}, and {row.label!r} in {row.place}"
                raise document.wrong("labels.mesh", rule)
    if not written:
        rule = f'is a list of meshes and classes, as \'{names.example},chair\' in each line, "folder" or "top folder"'
        first = f"{strange[0].place} is {strange[0].text[:60]!r}" if strange else f"{path.name} is empty"
        raise document.wrong("labels.mesh", f"{rule}; {first}")
    notes = []
    if strange:
        first = f"{strange[0].place}: {strange[0].text[:60]!r}"
        notes.append(f"{path.name}: {len(strange)} rows name no mesh, the first is {first}")
    if left := [entry.source for entry in entries if entry.id not in written]:
        notes.append(f"{path.name} has no class for {len(left)} meshes, which are left out; the first is {left[0]}")
    return written, tuple(notes)


def _classes(document: Document, values: list[str]) -> tuple[tuple[str, ...], dict[str, int]]:
    """Names, and class as written -> its index."""
    names = document.get("classes", values)
    if isinstance(names, list):
        check_once(document, names)
        if len(names) != len(values):
            raise document.wrong("classes", f"has {len(names)} names, and the classes are {', '.join(values)}")
        return tuple(names), {value: number for number, value in enumerate(values)}
    table: dict[str, int] = {}
    for number, (name, labels) in enumerate(names.items()):
        if isinstance(labels, dict):
            raise document.wrong("classes", f"has a table for {name!r}, which labels.mesh leaves no room for", name)
        for label in map(str, labels if isinstance(labels, list) else [labels]):
            if label in table:
                other = list(names)[table[label]]
                rule = f"has the label {label!r} for {name!r}, and the class {other!r} has it too"
                raise document.wrong("classes", rule, name)
            table[label] = number
    for value in values:
        if value not in table:
            hint = near(value, table) or "; add it, or take the table away: classes are then those that are found"
            raise document.wrong("classes", f"has no class {value!r}, which meshes have{hint}")
    return tuple(names), table
