"""Object File Format (OFF): a strict reader, one vertex or face a line, in file order.

COFF, NOFF, STOFF and the like are read too; their extra columns come after the coordinates and are left out, as are
the colours of faces. Indices count from 0. The counts of the header are promises to hold the file against.
"""

import re

import numpy as np
from jaxtyping import Int64

from meshshard_prep.formats.text import (
    COMMENT,
    COUNT,
    check_indices,
    check_not_empty,
    check_numeric,
    check_sizes,
    check_vertex_columns,
    coordinates,
    decode,
    fan_mesh,
    first_refused,
    integers,
    polygon_of,
    refusal,
    shown,
)
from meshshard_prep.mesh import RawMesh

_HEADER = re.compile(rb"(?:\s|#[^\r\n]*+)*+((?:ST|C|N)*(4?n?)OFF)(?=[\s\d#]|\Z)\s*(BINARY)?")
"""The keyword, after any comments. ModelNet glues the counts to it: OFF490 518 0."""


def is_off(data: bytes) -> bool:
    """Whether the first word is an OFF keyword."""
    return _HEADER.match(data) is not None


def parse_off(data: bytes, place: str) -> RawMesh:
    """Read the bytes of an OFF file; `place` names it in refusals (InvalidMesh)."""
    header = _HEADER.match(data)
    assert header is not None, "ask is_off first"
    if header[2] or header[3]:
        found = "this one is " + ("binary" if header[3] else "of another dimension")
        advice = "Convert it to a plain OFF, or to OBJ or PLY."
        raise refusal("unsupported-format", "an OFF file is text in 3 dimensions", found, place, advice)

    keyword_blanked = data[: header.start(1)] + b" " * len(header[1]) + data[header.end(1) :]
    rows: list[list[str]] = []
    lines: list[int] = []
    for number, line in enumerate(COMMENT.sub("", decode(keyword_blanked, place)).split("\n"), 1):
        words = line.split()
        if words:
            rows.append(words)
            lines.append(number)

    vertex_count, face_count = _counts(rows, lines, place)
    check_not_empty(vertex_count, face_count, place)
    end = 1 + vertex_count + face_count
    rule = f"the header's {vertex_count} vertices and {face_count} faces have a line each ({end - 1})"
    if len(rows) < end:
        raise refusal("truncated", rule, f"{len(rows) - 1} follow", place)
    if len(rows) > end:
        raise refusal("extra-data", rule, f"{len(rows) - 1} follow", f"{place}:{lines[end]}")

    vertex_rows, vertex_lines = rows[1 : 1 + vertex_count], lines[1 : 1 + vertex_count]
    face_rows, face_lines = rows[1 + vertex_count :], lines[1 + vertex_count :]
    for row, number in zip(vertex_rows, vertex_lines, strict=True):
        if len(row) != 3:
            check_vertex_columns(row, f"{place}:{number}")
    vertices = coordinates([word for row in vertex_rows for word in row[:3]], vertex_lines, place)
    corners, sizes = _polygons(face_rows, face_lines, place)
    check_indices(corners, sizes, vertex_count, lambda face: f"{place}:{face_lines[face]}")
    return fan_mesh(vertices, corners, sizes)


def _counts(rows: list[list[str]], lines: list[int], place: str) -> tuple[int, int]:
    """Vertices and faces promised; a third count, of edges, is often wrong or left out and never looked at."""
    rule = "the OFF keyword is followed by the counts of vertices, faces and edges"
    if not rows:
        raise refusal("truncated", rule, "the file ends", place)
    words, where = rows[0], f"{place}:{lines[0]}"
    if len(words) not in (2, 3):
        raise refusal("bad-line", rule, f"the line has {len(words)} columns", where)
    if not all(map(COUNT.fullmatch, words)):
        raise refusal("bad-number", rule, f"the line is {shown(' '.join(words))}", where)
    return int(words[0]), int(words[1])


def _polygons(
    rows: list[list[str]], lines: list[int], place: str
) -> tuple[Int64[np.ndarray, " C"], Int64[np.ndarray, " P"]]:
    """Corners in a flat list, and the number of corners of every face."""

    def where(face: int) -> str:
        return f"{place}:{lines[face]}"

    size_words = [row[0] for row in rows]
    try:
        sizes = integers(size_words)
    except ValueError:
        face = first_refused(integers, size_words)
        rule, found = "a face line starts with its number of corners", f"it has {shown(size_words[face])}"
        raise refusal("bad-face", rule, found, where(face)) from None
    check_sizes(sizes, where)

    corner_words: list[str] = []
    for face, (row, size) in enumerate(zip(rows, sizes.tolist(), strict=True)):
        if len(row) <= size:
            code = "truncated" if face == len(rows) - 1 else "bad-face"
            rule = f"a face line has as many corners as it says ({row[0]:.40})"
            raise refusal(code, rule, f"there are {len(row) - 1}", where(face))
        if len(row) > size + 1:
            check_numeric(row[size + 1 :], where(face))
        corner_words += row[1 : size + 1]
    try:
        return integers(corner_words), sizes
    except ValueError:
        corner = first_refused(integers, corner_words)
        found = f"the face has {shown(corner_words[corner])}"
        raise refusal("bad-face", "a corner is an integer", found, where(polygon_of(corner, sizes))) from None
