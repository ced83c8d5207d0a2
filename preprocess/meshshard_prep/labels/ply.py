"""The form "ply": a property of the faces or vertices of the PLY file that the mesh is in."""

import codecs

import numpy as np

from meshshard_prep.formats.ply import read_rows
from meshshard_prep.formats.ply_columns import Column
from meshshard_prep.formats.ply_header import GEOMETRY, INTEGERS, Header, is_ply, read_header
from meshshard_prep.labels.written import Written, bad_label, whole_numbers

ELEMENTS = ("face", "vertex")
NO_LABELS = frozenset(
    [*GEOMETRY, "red", "green", "blue", "alpha", "r", "g", "b", "a", "flags", "texnumber"]
    + [f"{kind}_{colour}" for kind in ("diffuse", "ambient", "specular") for colour in ("red", "green", "blue")]
    + ["nx", "ny", "nz", "u", "v", "s", "t"]
)
"""Integers that are something else in the files of common programs: they are not offered as labels."""


def read_ply(data: bytes, name: str, place: str) -> Written:
    """The property `name` of faces or vertices; "vertex label" is the property label of vertices, where faces have
    one too. Of integers, or of floating-point numbers that are whole."""
    data = data.removeprefix(codecs.BOM_UTF8)
    if not is_ply(data):
        raise bad_label("labels of the form ply are in a PLY file", "this is none", place, "name its form")
    header = read_header(data, place)
    element, number = _find(header, name, place)
    values = read_rows(data, header, place)[element][number]
    assert isinstance(values, np.ndarray)

    def where(row: int) -> str:
        return header.place_of(element, row, place)

    if values.dtype.kind == "f":
        values = whole_numbers(values, where, f"values of the property {name!r}")
    return Written.of_integers(values, where, element)


def _find(header: Header, name: str, place: str) -> tuple[str, int]:
    """Element of a property that is no list, and its number there."""
    found = [
        (element, number)
        for element in ELEMENTS
        if element in header.elements
        for number, column in enumerate(header.elements[element].properties)
        if not column.length_type and name in (column.name, f"{element} {column.name}")
    ]
    if len(found) != 1:
        has = f"{len(found)} have it" if found else f"there are {', '.join(_scalars(header)) or 'none'}"
        rule = f"one property of faces or vertices is called {name!r}"
        raise bad_label(rule, has, place, 'name one of these, or its element too, as "vertex label"')
    return found[0]


def _scalars(header: Header) -> list[str]:
    """Properties that hold one number a face or vertex."""
    return [
        f"{element} {column.name}"
        for element in ELEMENTS
        if element in header.elements
        for column in header.elements[element].properties
        if not column.length_type
    ]


def properties(data: bytes, place: str) -> list[tuple[str, str]]:
    """Name for `read_ply`, and domain, of each property that may be labels: no geometry, no colour, and integers, or
    floating-point numbers that are whole and not all alike, as programs write labels that know no others."""
    data = data.removeprefix(codecs.BOM_UTF8)
    header = read_header(data, place)
    found = [
        (element, number, column)
        for element in ELEMENTS
        if element in header.elements
        for number, column in enumerate(header.elements[element].properties)
        if not column.length_type and column.name.lower() not in NO_LABELS
    ]
    if any(column.type not in INTEGERS for _, _, column in found):
        rows = read_rows(data, header, place)
        found = [each for each in found if each[2].type in INTEGERS or _are_labels(rows[each[0]][each[1]])]
    names = [column.name for _, _, column in found]
    return [
        (column.name if names.count(column.name) == 1 else f"{element} {column.name}", element)
        for element, _, column in found
    ]


def _are_labels(values: Column) -> bool:
    assert isinstance(values, np.ndarray)
    return bool(np.all(np.isfinite(values) & (values == np.round(values)))) and len(np.unique(values)) > 1


def left_out(data: bytes, place: str) -> list[str]:
    """Properties of faces and vertices that are neither geometry nor offered as labels; empty for what is no PLY."""
    data = data.removeprefix(codecs.BOM_UTF8)
    if not is_ply(data):
        return []
    known = {*GEOMETRY, *(name.split()[-1] for name, _ in properties(data, place))}
    return [name for name in _scalars(read_header(data, place)) if name.split()[-1] not in known]
