"""A data set of your own, described by a small TOML file: docs/datasets.md lists the keys."""

import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from meshshard.palette import class_colour
from meshshard.remote import is_url, listed, to_path
from meshshard_prep.datasets.folder import mesh_entries
from meshshard_prep.datasets.layout import Draw, Entry, RawDataset
from meshshard_prep.datasets.meshcnn import read_classification, read_segmentation
from meshshard_prep.datasets.own.classes import with_classes
from meshshard_prep.datasets.own.document import Document, near, read_document
from meshshard_prep.datasets.own.labels import with_label_files
from meshshard_prep.datasets.own.mesh_labels import with_mesh_labels
from meshshard_prep.datasets.own.names import glob_pattern
from meshshard_prep.datasets.own.splits import with_splits

__all__ = ["read_toml"]


def read_toml(path: Path, raw: Path | None = None, draw: Draw = Draw()) -> RawDataset:  # noqa: B008  frozen
    """The data set that a TOML file describes. `raw` replaces its raw folder, which is a URL or relative to the file;
    all other paths in it are relative to the raw folder. `draw`: seed and fold of its splits.

    UsageError: every mistake, with its line, its key, what was found and what may be there.
    """
    document = read_document(path)
    name = document.get("name", path.stem)
    if not re.fullmatch(r"\w[\w. -]*", name):
        raise document.wrong("name", f"is letters, digits, '_', '-', '.' and blanks, not {name!r}")
    named = document.get("raw", ".")
    root = listed(raw or (to_path(named) if is_url(named) else path.parent / named))
    if not root.is_dir():
        raise document.wrong("raw", f"is a folder that is there, and {root} is not; correct it, or give --raw")
    dataset = _READERS[document.get("layout", "folder")](document, root)
    dataset = replace(
        dataset,
        name=name,
        colours=_colours(document, dataset.classes),
        licence=document.get("licence", ""),
        citation=document.get("citation", ""),
    )
    return with_splits(document, dataset, root, draw)


def _folder(document: Document, root: Path) -> RawDataset:
    entries = _wanted(document, mesh_entries(root), root)
    if "labels.mesh" not in document:
        entries = with_label_files(document, root, entries)
        labelled = any(entry.labels for entry in entries)
        classes, entries = with_classes(document, entries) if labelled else ((), entries)
        task = "segmentation" if labelled else "unlabelled"
        return RawDataset(name="", task=task, classes=classes, entries=entries)
    _refuse(
        document,
        "labels.mesh",
        "labels.files",
        "labels.form",
        "labels.name",
        "labels.domain",
        "labels.to",
        "labels.unlabelled",
    )
    classes, entries, notes = with_mesh_labels(document, root, entries)
    return RawDataset(name="", task="classification", classes=classes, entries=entries, notes=notes)


def _wanted(document: Document, entries: tuple[Entry, ...], root: Path) -> tuple[Entry, ...]:
    """The meshes whose path is like one of the patterns."""
    if "meshes" not in document:
        return entries
    globs = document.get("meshes")
    wanted = set()
    for number, glob in enumerate([globs] if isinstance(globs, str) else globs):
        pattern = glob_pattern(glob, document.place("meshes", number))
        found = [entry.id for entry in entries if pattern.fullmatch(entry.source)]
        if not found:
            rule = (
                f"has the pattern {glob!r}, and no mesh below {root} is like it; there is {entries[0].source!r}, say"
            )
            raise document.wrong("meshes", rule, number)
        wanted.update(found)
    return tuple(entry for entry in entries if entry.id in wanted)


def _segmentation(document: Document, root: Path) -> RawDataset:
    _refuse(document, "layout", "meshes", "labels.files", "labels.form", "labels.name", "labels.mesh")
    found = read_segmentation(root, first_value=0)  # its own reading of the labels is not needed
    entries = [_counting(document, entry) for entry in found.entries]
    classes, labelled = with_classes(document, entries)
    return replace(found, classes=classes, entries=labelled)


def _counting(document: Document, entry: Entry) -> Entry:
    assert entry.labels is not None, "the layout asks for a label file of each mesh"
    domains = (document.get("labels.domain"),) if "labels.domain" in document else entry.labels.domains
    return replace(entry, labels=replace(entry.labels, domains=domains, to=document.get("labels.to", "")))


def _classification(document: Document, root: Path) -> RawDataset:
    _refuse(document, "layout", "meshes", "classes", *(key for key in document.values if key.startswith("labels.")))
    return read_classification(root)


_READERS = {"folder": _folder, "meshcnn-segmentation": _segmentation, "meshcnn-classification": _classification}


def _refuse(document: Document, reason: str, *keys: str) -> None:
    """UsageError where one of the keys is there, which `reason` leaves no room for."""
    for key in keys:
        if key in document:
            raise document.wrong(key, f"does not go with {reason} = {document.get(reason)!r}; remove one of them")


def _colours(document: Document, classes: tuple[str, ...]) -> tuple[str, ...]:
    """A colour for each class: those of the file, and the palette's for the rest; none where the file has none."""
    colours: Mapping[str, str] = document.get("colours", {})
    for name, colour in colours.items():
        if name not in classes:
            raise document.wrong("colours", f"names {name!r}, which is no class{near(name, classes)}", name)
        if not re.fullmatch(r"#[0-9a-fA-F]{6}", colour):
            raise document.wrong("colours", f"are written as '#1a2b3c', not {colour!r}", name)
    return tuple(colours.get(name, class_colour(number)) for number, name in enumerate(classes)) if colours else ()
