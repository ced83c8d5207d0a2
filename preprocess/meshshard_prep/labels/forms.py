"""The ways in which labels are written, by name."""

from collections.abc import Callable

from meshshard_prep.labels.lines import read_lines
from meshshard_prep.labels.written import Written

FORMS: dict[str, Callable[[bytes, str, str], Written]] = {
    "lines": read_lines,
}
"""Form -> what reads it: takes the file's bytes, the name of a property or column, and the place for refusals."""
