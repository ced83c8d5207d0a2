"""The header of a PLY file: its elements, their properties, and where the rows begin."""

import re
from dataclasses import dataclass

from meshshard_prep.formats.text import COUNT, refusal, shown

INTEGERS = {"char": 1, "uchar": 1, "short": 2, "ushort": 2, "int": 4, "uint": 4} | {
    f"{sign}int{bits}": bits // 8 for sign in ("", "u") for bits in (8, 16, 32)
}
BYTES = INTEGERS | {"float": 4, "double": 8, "float32": 4, "float64": 8}
"""Type -> how many bytes it has."""

CORNERS = ("vertex_indices", "vertex_index")
GEOMETRY = (*"xyz", *CORNERS)

_MAGIC = re.compile(rb"ply[ \t]*(\r\n|\n|\r|\Z)")
_FORMAT = re.compile(r"format (\S+) (\S+)")
_ELEMENT = re.compile(r"element (\S+) (\S+)")
_PROPERTY = re.compile(rf"property (?:list ({'|'.join(INTEGERS)}) )?({'|'.join(BYTES)}) (\S+)")


@dataclass(frozen=True, kw_only=True)
class Property:
    """A column of an element; `length_type` is empty unless it is a list."""

    length_type: str
    type: str
    name: str


@dataclass(frozen=True, kw_only=True)
class Element:
    """Rows of one kind, as the header promises them."""

    rows: int
    properties: list[Property]


@dataclass(frozen=True, kw_only=True)
class Header:
    """The rows start at byte `end`, after line `lines`."""

    format: str
    elements: dict[str, Element]
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


def is_ply(data: bytes) -> bool:
    """Whether the first line is the word ply."""
    return _MAGIC.match(data) is not None


def read_header(data: bytes, place: str) -> Header:
    """The header of a file that `is_ply`; InvalidMesh with the line where it breaks the grammar."""
    magic = _MAGIC.match(data)
    assert magic is not None, "ask is_ply first"
    newline = magic[1] or b"\n"
    header_format = ""
    elements: dict[str, Element] = {}
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
            return Header(format=header_format, elements=elements, end=end, lines=number)
        elif (match := _ELEMENT.fullmatch(line)) and match[1] not in elements:
            if not COUNT.fullmatch(match[2]):
                raise refusal("bad-number", "an element has a count", f"the line has {shown(match[2])}", where)
            columns: list[Property] = []
            elements[match[1]] = Element(rows=int(match[2]), properties=columns)
        elif elements and (match := _PROPERTY.fullmatch(line)):
            columns.append(Property(length_type=match[1] or "", type=match[2], name=match[3]))
        else:
            rule = "a PLY header has elements, each once, and their properties"
            raise refusal("bad-line", rule, f"it has {shown(line)}", where)
    raise refusal("truncated", "a PLY header ends with end_header", "the file ends before", f"{place}:{number}")
