"""The table [labels] for labels of faces, edges or vertices: which file holds those of each mesh."""

import posixpath
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path, PurePosixPath

from meshshard_prep.datasets.folder import LABEL_SUFFIXES, labels_beside
from meshshard_prep.datasets.layout import DOMAINS, Entry, LabelFile
from meshshard_prep.datasets.own.document import Document, near

FORM_OF_SUFFIX = {".npy": "npy", ".json": "json", ".ply": "ply"}
"""Suffix of a label file -> how labels are written in it; "lines" for any other."""

IN_MESH = ("ply", "obj-group", "obj-material")
"""Forms whose labels are in the mesh file itself."""

PLACEHOLDERS = ("stem", "name", "folder", "below")
_PLACEHOLDER = re.compile(r"\{([^{}]*)\}")


def filled_in(pattern: str, source: str) -> str:
    """The pattern for the mesh at a path below the raw folder, as a path. {stem} is its file name without ending,
    {name} with it, {folder} its folder, {below} that without the first part: meshes/{below} beside labels/{below}."""
    path = PurePosixPath(source)
    below = PurePosixPath(*path.parts[1:-1])
    values = {"stem": path.stem, "name": path.name, "folder": str(path.parent), "below": str(below)}
    return posixpath.normpath(_PLACEHOLDER.sub(lambda found: values.get(found[1], found[0]), pattern))


def with_label_files(document: Document, root: Path, entries: Sequence[Entry]) -> tuple[Entry, ...]:
    """Entries with their label files, not yet with what labels mean; as they are where nothing has labels.

    UsageError: a pattern that is none, or that finds no file at all.
    """
    form = document.get("labels.form", "")
    if form == "ply" and "labels.name" not in document:
        raise document.wrong("labels.form", 'is "ply": say with labels.name which property of it the labels are')
    if form in IN_MESH and "labels.files" not in document:
        return tuple(replace(entry, labels=_label_file(document, entry.path)) for entry in entries)
    if "labels.files" in document:
        keys = _keys(document, entries)
        paths = [root / place for place in _places(document, entries, keys)]
        if not any(path.is_file() for path in paths):
            pattern = document.get("labels.files")
            raise document.wrong(
                "labels.files",
                f"finds no file: {pattern!r} asks for {paths[0]} as the labels of {entries[0].source}, and none of "
                f"{len(paths)} such files is there; paths are below raw, which is {root}",
            )
        files = [_label_file(document, path) for path in paths]
        files = [replace(file, name=key) for file, key in zip(files, keys, strict=True)] if keys else files
        return tuple(replace(entry, labels=file) for entry, file in zip(entries, files, strict=True))
    beside = {entry.path: found for entry in entries if (found := labels_beside(entry.path))}
    if not beside:
        if asked := [key for key in document.values if key.startswith("labels.")]:
            ends = ", ".join(LABEL_SUFFIXES)
            rule = f"is about label files, and no mesh has one of its name beside it ({ends}); say labels.files"
            raise document.wrong(asked[0], rule)
        return tuple(entries)
    missing = LABEL_SUFFIXES[0]
    return tuple(
        replace(entry, labels=_label_file(document, beside.get(entry.path, entry.path.with_suffix(missing))))
        for entry in entries
    )


def _label_file(document: Document, path: Path) -> LabelFile:
    return LabelFile(
        path=path,
        form=document.get("labels.form") or FORM_OF_SUFFIX.get(path.suffix.lower(), "lines"),
        name=document.get("labels.name", ""),
        domains=(document.get("labels.domain"),) if "labels.domain" in document else DOMAINS,
        to=document.get("labels.to", ""),
    )


def _keys(document: Document, entries: Sequence[Entry]) -> list[str]:
    """The key of each mesh in JSON files, where labels.name is a pattern; else none."""
    pattern = document.get("labels.name", "")
    if not document.get("labels.files").lower().endswith(".json") or not _PLACEHOLDER.search(pattern):
        return []
    return _filled_in(document, "labels.name", pattern, entries)


def _places(document: Document, entries: Sequence[Entry], keys: Sequence[str]) -> list[str]:
    """The pattern filled in for each mesh; a path below the raw folder. `keys`: where they tell meshes apart."""
    pattern = document.get("labels.files")
    if not keys and not _PLACEHOLDER.search(pattern):
        advice = "write {stem} in it" + ", or in labels.name if it has a key for each" * pattern.endswith(".json")
        raise document.wrong("labels.files", f"names one file for all meshes: {pattern!r}; {advice}")
    return _filled_in(document, "labels.files", pattern, entries)


def _filled_in(document: Document, key: str, pattern: str, entries: Sequence[Entry]) -> list[str]:
    for field in _PLACEHOLDER.findall(pattern):
        if field not in PLACEHOLDERS:
            known = ", ".join(f"{{{name}}}" for name in PLACEHOLDERS)
            raise document.wrong(key, f"may have {known}, not {{{field}}}{near(field, PLACEHOLDERS)}")
    return [filled_in(pattern, entry.source) for entry in entries]
