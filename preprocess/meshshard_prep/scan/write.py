"""The TOML file that describes a folder, with what was found as comments."""

import json
import os
import re
from collections import Counter
from collections.abc import Collection, Iterable, Mapping
from pathlib import Path

from meshshard.remote import RemotePath
from meshshard_prep.datasets.own.mesh_labels import FOLDER, TOP_FOLDER
from meshshard_prep.jobs import printable
from meshshard_prep.scan.labels import Labelling
from meshshard_prep.scan.look import Findings
from meshshard_prep.scan.reading import Reading

MOST_CLASSES = 200
"""More are not listed: `features` finds them."""

OFTEN_UNLABELLED = (-100, 255, 65535)
"""Labels that mean none in the files of many programs. Only the user knows."""

LEAST_TO_SPLIT = 4
"""Fewer meshes are not split."""

EDIT = "# EDIT: "

NO_LABELS = [
    "",
    "# no labels were found. Take away the # of lines, and say where they are:",
    "# [labels]",
    '# files = "labels/{stem}.txt"  # of faces, edges or vertices: the file of each mesh',
    '# mesh = "classes.csv"  # of whole meshes: a list with a line "mesh,class" for each',
]


def toml_of(findings: Findings, reading: Reading, name: str, raw: str) -> str:
    """The text of the file. `raw`: the folder, as seen from the file."""
    lines = [
        f"# {len(findings.entries)} meshes. What keys there are: docs/datasets.md of meshshard.",
        f"name = {_quoted(name)}",
        f"raw = {_quoted(raw)}",
        *_label_lines(findings, reading),
        *_split_lines(findings, reading),
    ]
    return "\n".join(lines) + "\n"


def _label_lines(findings: Findings, reading: Reading) -> list[str]:
    doubt = [f"{EDIT}{reading.doubt}."] if reading.doubt else []
    if reading.kind == "labels" and reading.labelling:
        ambiguous = bool(reading.others) or len(reading.labelling.domains) > 1
        table = ["", "[labels]", *(doubt if ambiguous else []), *_labelling(reading.labelling)]
        for other in reading.others:
            table += ["# or", *(f"# {line}" for line in _labelling(other))]
        if reading.others:
            return table  # their labels differ: `features` finds the classes of those that are kept
        return table + _classes(findings, reading.labelling, [] if ambiguous else doubt)
    if reading.kind == "class list":
        return ["", "[labels]", f"mesh = {_quoted(findings.lists.classes)}  # the class of each mesh"]
    if reading.kind == "class folders" and findings.folders:
        meshes = findings.folders.meshes
        if findings.folders.outermost:  # no table: `features` finds the classes of the line that is kept
            lines = {FOLDER: meshes, TOP_FOLDER: findings.folders.outermost}
            nearest, top = (f"mesh = {_quoted(which)}  # {_few(names)}" for which, names in lines.items())
            return ["", "[labels]", *doubt, nearest, f"# {top}"]
        table = [f"{_quoted(name)} = {_quoted(name)}  # {count} meshes" for name, count in meshes.items()]
        listed = ["", "[classes]", *table] if len(meshes) <= MOST_CLASSES else []
        return ["", "[labels]", *doubt, f"mesh = {_quoted(findings.folders.which)}  # its name is the class", *listed]
    return NO_LABELS


def _labelling(labelling: Labelling) -> list[str]:
    best, *rest = labelling.domains
    lines = [f"files = {_quoted(labelling.pattern)}"] if labelling.pattern else []
    lines += [f"form = {_quoted(labelling.form)}"]
    lines += [f"name = {_quoted(labelling.name)}"] if labelling.name else []
    lines += [f"domain = {_quoted(best)}  # fits {labelling.fits[best]} of {len(labelling.of)} meshes"]
    lines += [f"# domain = {_quoted(domain)}  # fits {labelling.fits[domain]} of them too" for domain in rest]
    lines += [
        f"# unlabelled = {value}  # if that means none; then take its line out of [classes]"
        for value in OFTEN_UNLABELLED
        if value in labelling.values
    ]
    lines += ['# to = "face"  # would turn them into labels of faces'] if best == "vertex" else []
    without = len(labelling.missing) + len(labelling.odd)
    return [*lines, *([f"# {without} meshes have no labels that fit: features will refuse them"] if without else [])]


def _classes(findings: Findings, labelling: Labelling, doubt: list[str]) -> list[str]:
    """Name = label, in a table for each set where there are several."""
    if len(labelling.values) > MOST_CLASSES:
        return [f"# {len(labelling.values)} classes: the distinct labels, rising"]
    if not findings.sets:
        return ["", "[classes]  # name = label", *_table(labelling.values, "")]
    lines = ["", *doubt]
    for name in findings.sets:
        inside = [values for source, values in labelling.of.items() if source.startswith(f"{name}/")]
        counted = Counter(value for values in inside for value in values)
        values = {value: counted[value] for value in labelling.values if value in counted}
        lines += [f"[classes.{_quoted(name)}]", *_table(values, f"{name} ")]
    return lines


def _table(values: Mapping[int | str, int], prefix: str) -> list[str]:
    """A line for each label; names beside integers are left out, as `features` would."""
    numbers = {value: count for value, count in values.items() if isinstance(value, int)} or values
    return [
        f"{_quoted(f'{prefix}{value}')} = {_quoted(value) if isinstance(value, str) else value}  # in {count} meshes"
        for value, count in numbers.items()
    ]


def _split_lines(findings: Findings, reading: Reading) -> list[str]:
    lists = findings.lists.splits
    if set(findings.splits) != {""}:
        shares = [f"{count} {split or 'in none'}" for split, count in findings.splits.items()]
        return ["", f"# splits by folders: {', '.join(shares)}", "# [splits]", *_group(findings, reading)]
    if "test" in lists or "train" in lists:
        return ["", "[splits]", *(f"{split} = {_quoted(file)}" for split, file in lists.items())]
    shares_line = "fractions = { train = 0.7, val = 0.15, test = 0.15 }  # drawn by --split-seed; or: folds = 5"
    if len(findings.entries) < LEAST_TO_SPLIT:
        return []
    if reading.kind == "none":
        return ["# [splits]", f"# {shares_line}"]
    return ["", "[splits]", shares_line, *_group(findings, reading)]


def _group(findings: Findings, reading: Reading) -> list[str]:
    """A hint for meshes that must stay together: those of a folder, or whose names begin alike."""
    hint = "meshes whose paths have the same text here are never in two drawn splits"
    if set(findings.splits) == {""} and findings.folders and reading.kind == "labels" and not findings.sets:
        ask = "do the meshes of a folder belong together, as of one patient? Then take away the # before group"
        folder = "(.*)/" if findings.folders.which == FOLDER else "([^/]*)/"
        return [f"{EDIT}{ask}.", f"# group = '{folder}'  # {hint}"]
    return [f"# group = '(.*)_pose'  # {hint}"]


def _few(names: Collection[str]) -> str:
    more = len(names) - 4
    return printable(", ".join([*names][:4])) + f" and {more} more" * (more > 0)


def _quoted(text: object) -> str:
    """A TOML string."""
    return json.dumps(printable(str(text)), ensure_ascii=False).replace("\x7f", "\\u007f")


def edits_of(text: str) -> list[tuple[int, str]]:
    """Number and text of the lines that ask to be looked at."""
    return [(number, line.removeprefix(EDIT)) for number, line in enumerate(text.splitlines(), 1) if EDIT in line]


def counted(names: Iterable[str]) -> str:
    """3 OBJ, 2 PLY."""
    return ", ".join(f"{count:,} {name}" for name, count in Counter(names).most_common())


def name_of(text: str) -> str:
    """A name that a data set may have."""
    return re.sub(r"^\W+|[^\w. -]", "_", printable(text)) or "data"


def seen_from(here: Path, folder: Path) -> str:
    """The folder as a file in `here` names it: relative, or a URL."""
    if isinstance(folder, RemotePath):
        return str(folder)
    return Path(os.path.relpath(folder.resolve(), here.resolve())).as_posix()
