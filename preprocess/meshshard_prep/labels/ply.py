"""The form "ply": a property of the faces or vertices of the PLY file that the mesh is in."""

import codecs

import numpy as np

from meshshard_prep.formats.ply import read_rows
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
    """Name for `read_ply`, and domain, of each integer property that may be labels: no geometry, no colour."""
    header = read_header(data.removeprefix(codecs.BOM_UTF8), place)
    found = [
        (element, column.name)
        for element in ELEMENTS
        if element in header.elements
        for column in header.elements[element].properties
        if not column.length_type and column.type in INTEGERS and column.name.lower() not in NO_LABELS
    ]
    names = [name for _, name in found]
    return [(name if names.count(name) == 1 else f"{element} {name}", element) for element, name in found]
