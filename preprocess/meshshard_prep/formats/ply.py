"""PLY: the header is read and held against the size of the file here; the rows are read by plyfile, one by one, or
all at once where each has as many bytes as the others.

plyfile keeps the order of the file, but allocates what a header promises and ignores what follows the last row.
Columns other than x, y, z of vertices and the corners of faces are left out of the mesh. Indices count from 0.
"""

import io
import warnings
from collections.abc import Callable

import numpy as np
from jaxtyping import Int64
from plyfile import PlyData, PlyElementParseError, PlyParseError

from meshshard.errors import InvalidMesh
from meshshard_prep.formats.ply_header import BYTES, CORNERS, INTEGERS, Header, read_header
from meshshard_prep.formats.ply_rows import even_rows
from meshshard_prep.formats.text import (
    check_finite,
    check_indices,
    check_not_empty,
    check_sizes,
    decode,
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
    scalars = {column.name for column in vertex if not column.length_type}
    lists = {column.name: column.length_type for column in face if column.length_type and column.type in INTEGERS}
    corner_names = [name for name in CORNERS if name in lists]
    if not corner_names or not scalars >= set("xyz"):
        rule = "a PLY mesh has x, y and z of vertices and an integer list vertex_indices of faces"
        raise refusal("bad-line", rule, "the header lacks one of them", place)
    content = read_rows(data, header, place)

    def where(name: str) -> Callable[[int], str]:
        return lambda row: header.place_of(name, row, place)

    with np.errstate(invalid="ignore"):  # widening a signalling NaN makes noise; check_finite refuses it
        vertices = np.stack([content["vertex"][axis] for axis in "xyz"], axis=1).astype(np.float64)
    check_finite(vertices, where("vertex"))
    polygons = content["face"][corner_names[0]]
    sizes = _signed(np.fromiter(map(len, polygons), np.int64, len(polygons)), lists[corner_names[0]])
    check_sizes(sizes, where("face"))
    corners = np.concatenate(polygons).astype(np.int64)
    check_indices(corners, sizes, len(vertices), where("face"))
    return fan_mesh(vertices, corners, sizes)


def _signed(lengths: Int64[np.ndarray, " P"], length_type: str) -> Int64[np.ndarray, " P"]:
    """What lengths that were read without a sign are in their own type."""
    return lengths if length_type.startswith("u") else lengths.astype(f"i{BYTES[length_type]}").astype(np.int64)


def read_rows(data: bytes, header: Header, place: str) -> dict[str, np.ndarray]:
    """Element -> its rows, columns under the names of `Header.key_of`; InvalidMesh where they are not as promised."""
    body = data[header.end :]
    _check_size(body, header, place)
    if header.is_text:
        body = _check_text(body, header, place).encode()
    elif rows := even_rows(body, header):
        return rows
    stream = io.BytesIO(header.for_plyfile() + body)
    try:
        with np.errstate(all="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # from np.loadtxt, for an empty list
            warnings.simplefilter("error", DeprecationWarning)  # from np.loadtxt, for an integer with a fraction
            content = PlyData.read(stream, mmap=False)
    except PlyElementParseError as error:
        raise _row_refusal(error, header, place) from error
    except OverflowError as error:
        rule = "every value fits the type of its property"
        raise refusal("bad-number", rule, f"plyfile says: {error}", place) from error
    except (PlyParseError, ValueError, DeprecationWarning) as error:
        rule = "the file follows the grammar of PLY"
        raise refusal("bad-line", rule, f"plyfile says: {error}", place) from error
    if not header.is_text and (left := len(stream.getbuffer()) - stream.tell()):
        raise refusal("extra-data", "the file ends with its last row", f"{left} bytes follow", place)
    return {element.name: element.data for element in content}


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


def _check_text(body: bytes, header: Header, place: str) -> str:
    """The rows as text, if they are as many as the header promises and have no characters that numbers have not."""
    text = decode(body, place, first_line=header.lines + 1).rstrip()
    lines = text.split("\n") if text else []
    promised = sum(element.rows for element in header.elements.values())
    rule = f"the rows that the header promises have a line each ({promised})"
    if len(lines) < promised:
        raise refusal("truncated", rule, f"{len(lines)} follow it", place)
    if len(lines) > promised:
        raise refusal("extra-data", rule, f"{len(lines)} follow it", f"{place}:{header.lines + promised + 1}")
    if "_" in text or not text.isascii():
        bad = next(at for at, line in enumerate(lines) if "_" in line or not line.isascii())
        where = f"{place}:{header.lines + bad + 1}"
        raise refusal("bad-number", "a row is made of numbers", f"this one is {shown(lines[bad])}", where)
    return text


def _row_refusal(error: PlyElementParseError, header: Header, place: str) -> InvalidMesh:
    """What plyfile could not read, in the words of this package."""
    name = error.element.name
    code = {"early end-of-file": "truncated", "malformed input": "bad-number"}.get(error.message, "bad-line")
    rule = f"the rows of {name} are what the header says"
    if code == "bad-number" and name == "face" and error.prop.name in CORNERS:
        code = "index-out-of-range"
        rule = f"a face index is a whole number from 0 to {header.rows('vertex') - 1}"
    return refusal(code, rule, f"plyfile says: {error}", header.place_of(name, error.row or 0, place))
