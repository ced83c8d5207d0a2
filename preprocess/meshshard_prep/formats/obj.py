"""Wavefront OBJ: a strict reader that keeps vertices and faces in file order.

Of the statements, `v` and `f` make the mesh. Columns after the third coordinate (weight, colour) and the texture and
normal parts of a corner are left out. Indices count from 1; negative ones count back from the vertices before the
face.
"""

import re

import numpy as np
from jaxtyping import Int64

from meshshard.errors import InvalidMesh
from meshshard_prep.formats.text import (
    COMMENT,
    check_not_empty,
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

_GEOMETRY = "p l vt vn vp vw cstype deg bmat step curv curv2 surf parm trim hole scrv sp end con"
_GROUPING = "g s o mg usemtl usemap mtllib maplib bevel c_interp d_interp lod shadow_obj trace_obj ctech stech"
_MATERIAL = "newmtl Ka Kd Ks Ke Ns Ni Tr Tf d illum map_Ka map_Kd map_Ks map_Ns map_d map_Bump map_bump bump disp"
"""Statements of the material file, which some exporters write into the mesh."""

_IGNORED = frozenset(f"{_GEOMETRY} {_GROUPING} {_MATERIAL}".split())
STATEMENTS = _IGNORED | {"v", "f"}

_CONTINUED = re.compile(r"^((?:[^\n]*\\[ \t]*\n)+)([^\n]*)", re.MULTILINE)
_CORNER = re.compile(r"([+-]?[0-9]+)(?:/[+-]?[0-9]*(?:/[+-]?[0-9]*)?)?")
_PROMISE = re.compile(r"#[ \t]*(Vertices|Faces):[ \t]*([0-9]{1,18})[ \t]*(?:\n|\Z)")


def parse_obj(data: bytes, place: str) -> RawMesh:
    """Read the bytes of an OBJ file; `place` names it in refusals (InvalidMesh)."""
    text = decode(data, place)
    statements = statement_lines(text)
    vertex_words: list[str] = []
    vertex_lines: list[int] = []
    corner_words: list[str] = []
    face_sizes: list[int] = []
    face_lines: list[int] = []
    for number, line in enumerate(statements, 1):
        words = line.split()
        if not words:
            continue
        keyword = words[0]
        if keyword == "v":
            if len(words) != 4:
                check_vertex_columns(words[1:], f"{place}:{number}")
            vertex_words += words[1:4]
            vertex_lines.append(number)
        elif keyword == "f":
            corner_words += words[1:]
            face_sizes.append(len(words) - 1)
            face_lines.append(number)
        elif keyword not in _IGNORED:
            rule, found = "a line starts with an OBJ statement such as v or f", f"this one has {shown(keyword)}"
            raise refusal("bad-line", rule, found, f"{place}:{number}")

    _check_promises(text, len(vertex_lines), len(face_lines), place)
    check_not_empty(len(vertex_lines), len(face_lines), place)
    vertices = coordinates(vertex_words, vertex_lines, place)
    sizes = np.array(face_sizes, dtype=np.int64)
    check_sizes(sizes, lambda face: f"{place}:{face_lines[face]}")
    corners = _corners(corner_words, sizes, face_lines, vertex_lines, place)
    ends_in_face = face_lines[-1] == len(statements)  # a line end behind it would make one more, empty, line
    if ends_in_face and (unused := len(vertices) - len(np.unique(corners))):
        rule = "a file that ends without a line end uses all its vertices"
        found = f"it ends in a face and leaves {unused} of {len(vertices)} unused"
        raise refusal("truncated", rule, found, f"{place}:{face_lines[-1]}")
    return fan_mesh(vertices, corners, sizes)


def statement_lines(text: str) -> list[str]:
    """Lines without comments, of decoded text; a continued line is one, followed by as many empty ones as it took."""
    text = COMMENT.sub("", text)
    if "\\" in text:
        text = _CONTINUED.sub(_join, text)
    return text.split("\n")


def _join(match: re.Match[str]) -> str:
    lines = match[1].split("\n")[:-1]
    return " ".join(line.rstrip(" \t")[:-1] for line in lines) + " " + match[2] + "\n" * len(lines)


def _check_promises(text: str, vertices: int, faces: int, place: str) -> None:
    """MeshLab and others write "# Vertices: N" and "# Faces: N" on top; fewer than that is a cut file."""
    promises = _PROMISE.findall(text)
    for name, found in (("Vertices", vertices), ("Faces", faces)):
        counts = [int(count) for promised, count in promises if promised == name]
        if len(counts) == 1 and counts[0] > found:
            rule = f"the file has what its comment '# {name}: {counts[0]}' promises"
            raise refusal("truncated", rule, f"it has {found}", place)


def _corners(
    words: list[str], sizes: Int64[np.ndarray, " P"], face_lines: list[int], vertex_lines: list[int], place: str
) -> Int64[np.ndarray, " C"]:
    """Vertex indices from 0, P faces in a flat list."""

    def refused(code: str, rule: str, found: str, corner: int) -> InvalidMesh:
        return refusal(code, rule, found, f"{place}:{face_lines[polygon_of(corner, sizes)]}")

    try:
        indices = _indices(words)
    except ValueError:
        corner = first_refused(_indices, words)
        rule = "a corner is an integer, or i/t, i//n, i/t/n"
        raise refused("bad-face", rule, f"the face has {shown(words[corner])}", corner) from None

    vertices_before = np.repeat(np.searchsorted(vertex_lines, face_lines), sizes)
    corners = np.where(indices < 0, vertices_before + indices, indices - 1)
    outside = (corners < 0) | (corners >= len(vertex_lines))
    if outside.any():
        corner = int(np.argmax(outside))
        rule = f"a face index lies between 1 and the number of vertices ({len(vertex_lines)})"
        found = f"the face has index {words[corner]:.40}"
        if indices[corner] < 0:
            rule = "a negative face index counts back over the vertices before the face"
            found += f", and {vertices_before[corner]} are before it"
        raise refused("index-out-of-range", rule, found, corner)
    return corners


def _indices(words: list[str]) -> Int64[np.ndarray, " N"]:
    """The vertex part of corners, as written; ValueError where one is no corner."""
    if "/" not in "".join(words):
        return integers(words)
    matches = [_CORNER.fullmatch(word) for word in words]
    if None in matches:
        raise ValueError("no corner")
    return integers([match[1] for match in matches if match])
