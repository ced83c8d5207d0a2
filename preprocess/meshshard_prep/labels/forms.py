"""The ways in which labels are written, by name."""

from collections.abc import Callable

from meshshard.errors import InvalidMesh
from meshshard_prep.formats import format_of
from meshshard_prep.labels.json_list import read_json
from meshshard_prep.labels.lines import read_lines
from meshshard_prep.labels.npy import read_npy
from meshshard_prep.labels.obj import STATEMENTS, read_obj
from meshshard_prep.labels.ply import properties, read_ply
from meshshard_prep.labels.psb import read_psb
from meshshard_prep.labels.table import read_table
from meshshard_prep.labels.written import Written

FORMS: dict[str, Callable[[bytes, str, str], Written]] = {
    "lines": read_lines,
    "npy": read_npy,
    "json": read_json,
    "ply": read_ply,
    **{form: read_obj(statements) for form, statements in STATEMENTS.items()},
    "psb": read_psb,
    "last-column": read_table,
}
"""Form -> what reads it: takes the file's bytes, the name of a property or key, and the place for refusals."""


def offered(data: bytes, suffix: str) -> list[tuple[str, str, str]]:
    """Form, name and domain of each labelling that a mesh file itself may hold: the properties of a PLY that are
    neither geometry nor colour, and whole numbers; groups and materials of an OBJ, where faces are in two or more.
    `suffix` is that of the file's name. Empty for what is no mesh."""
    try:
        kind = format_of(data, "", suffix)
        if kind == "PLY":
            return [("ply", name, domain) for name, domain in properties(data, "")]
        forms = STATEMENTS if kind == "OBJ" else {}
        return [(form, "", "face") for form in forms if _names(FORMS[form](data, "", "")) > 1]
    except InvalidMesh:
        return []


def _names(found: Written) -> int:
    """How many names faces have; a statement without faces counts for nothing."""
    return len({*found.which.tolist()} - {-1})
