"""The classes of a data set from its label files, where nobody says them."""

import contextlib
from collections.abc import Sequence
from pathlib import Path

from meshshard.errors import InvalidMesh, UsageError
from meshshard_prep.formats import read_file
from meshshard_prep.labels.forms import FORMS
from meshshard_prep.labels.label_file import LabelFile
from meshshard_prep.labels.written import UNLABELLED, in_order

MOST_CLASSES = 2**15
"""Labels are stored in 16 bits."""


def class_table(
    files: Sequence[LabelFile], names: tuple[str, ...], place: Path
) -> tuple[tuple[str, ...], dict[int | str, int]]:
    """Class names, and what is written -> class index, from the distinct integers of label files, rising; from names
    in alphabetical order where no file holds an integer.

    `names` are the class names to use, or empty: then what is written is. What is neither, and files that cannot be
    read, are left to the run, which refuses that mesh alone. UsageError where names and labels differ in number.
    """
    values: set[int | str] = set()
    for file in files:
        with contextlib.suppress(InvalidMesh):
            values.update(FORMS[file.form](read_file(file.path, file.path.name), file.name, file.path.name).values)
    values -= {UNLABELLED, ""}
    values = {value for value in values if isinstance(value, int)} or values
    if len(values) > MOST_CLASSES:
        raise UsageError(
            f"{place}: the label files hold {len(values)} distinct labels, and a data set has {MOST_CLASSES} "
            "classes at most; move files away that are no labels"
        )
    ordered = in_order(values)
    if names and len(names) != len(ordered):
        raise UsageError(f"{place}: {len(names)} class names, but the label files hold the labels {ordered}")
    return names or tuple(map(str, ordered)), {value: number for number, value in enumerate(ordered)}
