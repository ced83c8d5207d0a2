"""The keys classes and labels.unlabelled: what the labels in the label files mean."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from meshshard_prep.datasets.layout import Entry
from meshshard_prep.datasets.own.document import Document
from meshshard_prep.labels import UNLABELLED, class_table

Table = Mapping[int | str, int]


def with_classes(document: Document, entries: Sequence[Entry]) -> tuple[tuple[str, ...], tuple[Entry, ...]]:
    """Class names, and entries whose label files say which label is which class.

    A table of classes is taken as it is; otherwise the label files are read, and their distinct labels, rising, are
    the classes. UsageError: names that do not fit, a label or name that is there twice.
    """
    classes = document.get("classes", [])
    if isinstance(classes, list):
        names, table = _found(document, entries, classes)
        return names, _with_table(entries, lambda _: table)
    nested = any(isinstance(value, dict) for value in classes.values())
    folders: Mapping[str, Any] = classes if nested else {"": classes}
    names = tuple(dict.fromkeys(name for table in folders.values() for name in table))
    number = {name: place for place, name in enumerate(names)}
    tables = {folder: _by_label(document, folder, table, number) for folder, table in folders.items()}
    if nested and (outside := [entry for entry in entries if not _folder_of(entry, tables)]):
        rule = f"is a table for each folder, of {', '.join(tables)}, and {outside[0].source} is in none of them"
        raise document.wrong("classes", rule)
    return names, _with_table(entries, lambda entry: tables[_folder_of(entry, tables)] if nested else tables[""])


def _found(document: Document, entries: Sequence[Entry], names: list[str]) -> tuple[tuple[str, ...], Table]:
    """Classes from the labels in the files, named by `names`, or as written."""
    check_once(document, names)
    files = [entry.labels for entry in entries if entry.labels is not None and entry.labels.path.is_file()]
    ordered = list(class_table(files, (), document.path)[1])
    unlabelled = _unlabelled(document)
    ordered = [value for value in ordered if value not in unlabelled]
    if names and len(names) != len(ordered):
        shown = ", ".join(map(str, ordered[:20])) + ", ..." * (len(ordered) > 20)
        raise document.wrong(
            "classes", f"has {len(names)} names, and the label files have {len(ordered)} labels: {shown}"
        )
    table = {value: number for number, value in enumerate(ordered)}
    return tuple(names) or tuple(map(str, ordered)), table | unlabelled


def check_once(document: Document, names: Sequence[str]) -> None:
    """UsageError: a class is named twice."""
    for place, name in enumerate(names):
        if name in names[:place]:
            raise document.wrong("classes", f"names {name!r} twice", place)


def _by_label(document: Document, folder: str, table: Mapping[str, Any], number: Mapping[str, int]) -> Table:
    """Label -> class index, of a table of name = label or name = [labels]."""
    found = _unlabelled(document)
    names = {value: "" for value in found}
    for name, value in table.items():
        for label in value if isinstance(value, list) else [value]:
            if label == UNLABELLED:
                inside = (folder, name) if folder else (name,)
                raise document.wrong(
                    "classes", f"has the label -1 for {name!r}, and -1 always means unlabelled", *inside
                )
            if label in found:
                other = f"the class {names[label]!r}" if names[label] else "labels.unlabelled"
                inside = (folder, name) if folder else (name,)
                raise document.wrong(
                    "classes", f"has the label {label!r} for {name!r}, and {other} has it too", *inside
                )
            found[label], names[label] = number[name], name
    return found


def _unlabelled(document: Document) -> dict[int | str, int]:
    value = document.get("labels.unlabelled", [])
    return dict.fromkeys(value if isinstance(value, list) else [value], UNLABELLED)


def _folder_of(entry: Entry, folders: Mapping[str, Any]) -> str:
    """The longest of the folders that hold the mesh, or empty."""
    holding = [folder for folder in folders if folder and entry.source.startswith(f"{folder}/")]
    return max(holding, key=len, default="")


def _with_table(entries: Sequence[Entry], table_of: Callable[[Entry], Table]) -> tuple[Entry, ...]:
    return tuple(
        replace(entry, labels=replace(entry.labels, classes=table_of(entry))) if entry.labels else entry
        for entry in entries
    )
