"""PLY: the header is read and held against the size of the file here, the rows are read by plyfile.

plyfile keeps the order of the file, but allocates what a header promises and ignores what follows the last row.
Columns other than x, y, z of vertices and the corners of faces are left out. Indices count from 0.
"""

import io
import re
import warnings
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Int64
from plyfile import PlyData, PlyElementParseError, PlyParseError

from meshshard.errors import InvalidMesh
from meshshard_prep.formats.text import (
    COUNT,
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

_INTEGERS = {"char": 1, "uchar": 1, "short": 2, "ushort": 2, "int": 4, "uint": 4} | {
    f"{sign}int{bits}": bits // 8 for sign in ("", "u") for bits in (8, 16, 32)
}
_UNSIGNED = {1: "uchar", 2: "ushort", 4: "uint"}
_BYTES = _INTEGERS | {"float": 4, "double": 8, "float32": 4, "float64": 8}

_MAGIC = re.compile(rb"ply[ \t]*(\r\n|\n|\r|\Z)")
_FORMAT = re.compile(r"format (\S+) (\S+)")
_ELEMENT = re.compile(r"element (\S+) (\S+)")
_PROPERTY = re.compile(rf"property (?:list ({'|'.join(_INTEGERS)}) )?({'|'.join(_BYTES)}) (\S+)")
_CORNERS = ("vertex_indices", "vertex_index")
_READ = (*"xyz", *_CORNERS)


@dataclass(frozen=True, kw_only=True)
class _Property:
    """A column of an element; `length_type` is empty unless it is a list."""

    length_type: str
    type: str
    name: str


@dataclass(frozen=True, kw_only=True)
class _Element:
    """Rows of one kind, as the header promises them."""

    rows: int
    properties: list[_Property]


@dataclass(frozen=True, kw_only=True)
class _Header:
    """The rows start at byte `end`, after line `lines`."""

    format: str
    elements: dict[str, _Element]
    end: int
    lines: int

    @property
    def is_text(self) -> bool:
        return self.format == "ascii"

    def rows(self, name: str) -> int:
        return self.elements[name].rows if name in self.elements else 0

    def place_of(self, name: str, row: int, place: str) -> str:
        """The line of a row in a text file; a binary file has no lines."""
        if not self.is_text:
            return place
        before = list(self.elements)[: list(self.elements).index(name)]
        return f"{place}:{self.lines + sum(map(self.rows, before)) + row + 1}"

    def for_plyfile(self) -> bytes:
        """Without comments, blanks and odd line ends. Names that are not read may be there twice in real files."""
        lines = ["ply", f"format {self.format} 1.0"]
        for element_name, element in self.elements.items():
            lines.append(f"element {element_name} {element.rows}")
            for number, column in enumerate(element.properties):
                # no length is negative: of a list of length -1 plyfile would read the rest of the file
                length = f"list {_UNSIGNED[_BYTES[column.length_type]]} " if column.length_type else ""
                name = column.name if column.name in _READ else f"{column.name}~{number}"
                lines.append(f"property {length}{column.type} {name}")
        return "\n".join([*lines, "end_header", ""]).encode("latin-1")


def is_ply(data: bytes) -> bool:
    """Whether the first line is the word ply."""
    return _MAGIC.match(data) is not None


def parse_ply(data: bytes, place: str) -> RawMesh:
    """Read the bytes of a PLY file; `place` names it in refusals (InvalidMesh)."""
    header = _read_header(data, place)
    if header.rows("tristrips"):
        rule, found = "the faces of a PLY are polygons", "this one has triangle strips"
        raise refusal("unsupported-format", rule, found, place, "Convert it to plain triangles.")
    check_not_empty(header.rows("vertex"), header.rows("face"), place)
    vertex, face = header.elements["vertex"].properties, header.elements["face"].properties
    scalars = {column.name for column in vertex if not column.length_type}
    lists = {column.name: column.length_type for column in face if column.length_type and column.type in _INTEGERS}
    corner_names = [name for name in _CORNERS if name in lists]
    if not corner_names or not scalars >= set("xyz"):
        rule = "a PLY mesh has x, y and z of vertices and an integer list vertex_indices of faces"
        raise refusal("bad-line", rule, "the header lacks one of them", place)
    content = _read_rows(data[header.end :], header, place)

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
    return lengths if length_type.startswith("u") else lengths.astype(f"i{_BYTES[length_type]}").astype(np.int64)


def _read_header(data: bytes, place: str) -> _Header:
    magic = _MAGIC.match(data)
    assert magic is not None, "ask is_ply first"
    newline = magic[1] or b"\n"
    header_format = ""
    elements: dict[str, _Element] = {}
    end, number = magic.end(), 1
    while end < len(data):
        number += 1
        where = f"{place}:{number}"
        stop = data.find(newline, end)
        stop = len(data) if stop < 0 else stop
        line = " ".join(data[end:stop].decode("latin-1").split())
        end = min(stop + len(newline), len(data))
        if line.split(" ")[0] in ("", "comment", "obj_info"):
            continue
        if not header_format:
            if not (match := _FORMAT.fullmatch(line)):
                raise refusal("bad-line", "a PLY header starts with its format", f"it has {shown(line)}", where)
            if match[1] not in ("ascii", "binary_little_endian", "binary_big_endian") or match[2] != "1.0":
                raise refusal("unsupported-format", "a PLY is ascii or binary, 1.0", f"it has {shown(line)}", where)
            header_format = match[1]
        elif line == "end_header":
            return _Header(format=header_format, elements=elements, end=end, lines=number)
        elif (match := _ELEMENT.fullmatch(line)) and match[1] not in elements:
            if not COUNT.fullmatch(match[2]):
                raise refusal("bad-number", "an element has a count", f"the line has {shown(match[2])}", where)
            columns: list[_Property] = []
            elements[match[1]] = _Element(rows=int(match[2]), properties=columns)
        elif elements and (match := _PROPERTY.fullmatch(line)):
            columns.append(_Property(length_type=match[1] or "", type=match[2], name=match[3]))
        else:
            rule = "a PLY header has elements, each once, and their properties"
            raise refusal("bad-line", rule, f"it has {shown(line)}", where)
    raise refusal("truncated", "a PLY header ends with end_header", "the file ends before", f"{place}:{number}")


def _read_rows(body: bytes, header: _Header, place: str) -> PlyData:
    _check_size(body, header, place)
    if header.is_text:
        body = _check_text(body, header, place).encode()
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
    return content


def _check_size(body: bytes, header: _Header, place: str) -> None:
    """The promised rows fit into the file, so that no more memory is taken than a multiple of its size."""
    least = 0
    for name, element in header.elements.items():
        if element.rows and not element.properties:
            raise refusal("bad-line", "an element with rows has properties", f"{shown(name)} has none", place)
        for column in element.properties:  # in a text it takes a digit and a blank
            least += element.rows * (2 if header.is_text else _BYTES[column.length_type or column.type])
    if least > len(body):
        rule, found = f"the rows that the header promises take {least} bytes or more", f"{len(body)} follow it"
        raise refusal("truncated", rule, found, place)


def _check_text(body: bytes, header: _Header, place: str) -> str:
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


def _row_refusal(error: PlyElementParseError, header: _Header, place: str) -> InvalidMesh:
    """What plyfile could not read, in the words of this package."""
    name = error.element.name
    code = {"early end-of-file": "truncated", "malformed input": "bad-number"}.get(error.message, "bad-line")
    rule = f"the rows of {name} are what the header says"
    if code == "bad-number" and name == "face" and error.prop.name in _CORNERS:
        code = "index-out-of-range"
        rule = f"a face index is a whole number from 0 to {header.rows('vertex') - 1}"
    return refusal(code, rule, f"plyfile says: {error}", header.place_of(name, error.row or 0, place))
