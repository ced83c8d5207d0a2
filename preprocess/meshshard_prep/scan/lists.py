"""Files that list meshes: with a class each, or as a split."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from meshshard.errors import UsageError
from meshshard_prep.datasets.folder import SPLIT_FOLDERS
from meshshard_prep.datasets.own.class_list import read_class_list
from meshshard_prep.datasets.own.names import Names

SUFFIXES = (".txt", ".csv", ".tsv", ".lst", ".list", ".json")
MOST_BYTES = 20_000_000
LEAST_SHARE = 0.8
"""Share of the lines that must name a mesh."""


@dataclass(frozen=True, kw_only=True)
class Lists:
    """`classes`: the file that has the class of each mesh, or empty; `splits`: split -> the file that lists it.
    `unused`: what lists meshes and is not taken, as sentences."""

    classes: str
    splits: dict[str, str]
    unused: tuple[str, ...] = ()


def find_lists(root: Path, others: Sequence[str], names: Names) -> Lists:
    """The lists among the files; none for a purpose that several have: nobody can tell which is meant."""
    classes, splits, unused = [], [], []
    for other in sorted(others):
        if PurePosixPath(other).suffix.lower() in SUFFIXES and (root / other).stat().st_size <= MOST_BYTES:
            kind = _kind(root / other, names)
            classes += [other] if kind == "classes" else []
            split = _split_of(PurePosixPath(other).stem) if kind == "meshes" else ""
            splits += [(split, other)] if split else []
            unused += [f"{other} has more columns than two: keep mesh and class"] if kind == "table" else []
    of_split = {split: [file for found, file in splits if found == split] for split, _ in splits}
    if len(classes) > 1:
        unused.append(f"{', '.join(classes)} list classes, and labels.mesh takes one file: make one of them")
    return Lists(
        classes=classes[0] if len(classes) == 1 else "",
        splits={split: files[0] for split, files in of_split.items() if len(files) == 1},
        unused=tuple(unused),
    )


def _kind(path: Path, names: Names) -> str:
    """ "meshes", "classes", "table", whose first of several columns names meshes, or empty."""
    try:
        rows = read_class_list(path, path.name)
    except UsageError:
        return ""
    enough = max(LEAST_SHARE * len(rows), 2)
    if path.suffix.lower() != ".json" and sum(len(names.find(row.text)) == 1 for row in rows) >= enough:
        return "meshes"
    labels = [row.label for row in rows if row.label and len(names.find(row.mesh)) == 1]
    if len(labels) >= enough:
        return "classes" if 1 < len({*labels}) <= len(labels) / 2 else ""
    firsts = [re.split("[,;\t]", row.mesh)[0].strip('"') for row in rows]
    return "table" if sum(len(names.find(first)) == 1 for first in firsts) >= enough else ""


def _split_of(stem: str) -> str:
    """The split that a part of a list's name names: train_list, human-test, split.val."""
    return next((SPLIT_FOLDERS[word] for word in re.split(r"[^a-z]+", stem.lower()) if word in SPLIT_FOLDERS), "")
