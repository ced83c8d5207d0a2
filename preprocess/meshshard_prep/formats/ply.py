"""PLY: the header is read and held against the size of the file, then the rows are read as it says, in their order.

Columns other than x, y, z of vertices and the corners of faces are left out of the mesh. Indices count from 0.
"""

from collections.abc import Callable

import numpy as np
from jaxtyping import Int64

from meshshard_prep.formats.ply_binary import binary_rows
from meshshard_prep.formats.ply_columns import Column, Lists
from meshshard_prep.formats.ply_header import BYTES, CORNERS, GEOMETRY, INTEGERS, Header, read_header
from meshshard_prep.formats.ply_text import text_rows
from meshshard_prep.formats.text import (
    check_finite,
    check_indices,
    check_not_empty,
    check_sizes,
    fan_mesh,
    refusal,
    shown,
)
from meshshard_prep.mesh import RawMesh


def parse_ply(data: bytes, place: str) -> RawMesh:
    """Read the bytes of a PLY file; `place` names it in refusals (InvalidMesh)."""
    header = read_header(data, place)
    if header.rows("tristrips"):
        rule, found = "the faces of a PLY are polygons", "this one has triangle strips"
        raise refusal("unsupported-format", rule, found, place, "Convert it to plain triangles.")
    check_not_empty(header.rows("vertex"), header.rows("face"), place)
    vertex, face = header.elements["vertex"].properties, header.elements["face"].properties
    axes = {column.name: number for number, column in enumerate(vertex) if not column.length_type}
    lists = {c.name: number for number, c in enumerate(face) if c.length_type and c.type in INTEGERS}
    corner_names = [name for name in CORNERS if name in lists]
    if not corner_names or not axes.keys() >= set("xyz"):
        rule = "a PLY mesh has x, y and z of vertices and an integer list vertex_indices of faces"
        raise refusal("bad-line", rule, "the header lacks one of them", place)
    content = read_rows(data, header, place)

    def where(name: str) -> Callable[[int], str]:
        return lambda row: header.place_of(name, row, place)

    with np.errstate(invalid="ignore"):  # widening a signalling NaN makes noise; check_finite refuses it
        vertices = np.stack([np.asarray(content["vertex"][axes[axis]]) for axis in "xyz"], axis=1).astype(np.float64)
    check_finite(vertices, where("vertex"))
    number = lists[corner_names[0]]
    polygons = content["face"][number]
    assert isinstance(polygons, Lists)
    sizes = _signed(polygons.lengths, face[number].length_type)
    check_sizes(sizes, where("face"))
    corners = polygons.values.astype(np.int64)
    check_indices(corners, sizes, len(vertices), where("face"))
    return fan_mesh(vertices, corners, sizes)


def _signed(lengths: Int64[np.ndarray, " P"], length_type: str) -> Int64[np.ndarray, " P"]:
    """What lengths that were read without a sign are in their own type."""
    return lengths if length_type.startswith("u") else lengths.astype(f"i{BYTES[length_type]}").astype(np.int64)


def read_rows(data: bytes, header: Header, place: str) -> dict[str, list[Column]]:
    """Element -> a column for each of its properties; InvalidMesh where the rows are not as promised."""
    body = data[header.end :]
    _check_size(body, header, place)
    _check_names(header, place)
    return (text_rows if header.is_text else binary_rows)(body, header, place)


def _check_size(body: bytes, header: Header, place: str) -> None:
    """The promised rows fit into the file, so that no more memory is taken than a multiple of its size."""
    least = 0
    for name, element in header.elements.items():
        if element.rows and not element.properties:
            raise refusal("bad-line", "an element with rows has properties", f"{shown(name)} has none", place)
        for column in element.properties:  # in a text it takes a digit and a blank
            least += element.rows * (2 if header.is_text else BYTES[column.length_type or column.type])
    if least > len(body):
        rule, found = f"the rows that the header promises take {least} bytes or more", f"{len(body)} follow it"
        raise refusal("truncated", rule, found, place)


def _check_names(header: Header, place: str) -> None:
    """Names are ASCII, and coordinates and corners are there once: other names may be there twice in real files."""
    for name, element in header.elements.items():
        names = [column.name for column in element.properties]
        for called in (name, *names):
            if not called.isascii():
                raise refusal("bad-line", "names in a PLY header are ASCII", f"it has {shown(called)}", place)
        for called in GEOMETRY:
            if names.count(called) > 1:
                rule = "coordinates and corners are one property each"
                raise refusal("bad-line", rule, f"{name} has {called} {names.count(called)} times", place)
