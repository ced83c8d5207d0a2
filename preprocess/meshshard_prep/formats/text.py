"""What the readers share: refusals, text in lines, strict numbers, checked indices, polygons cut into triangles."""

import re
from collections.abc import Callable

import numpy as np
from jaxtyping import Float64, Int64

from meshshard.errors import InvalidMesh
from meshshard_prep.mesh import RawMesh

CONTROL_BYTES = bytes(set(range(32)) - set(b"\t\n\r")) + b"\x7f"
"""Bytes that no text mesh has. str.split() would take some of them for white space and cut a number in two."""

COMMENT = re.compile(r"#(?<!\.#)[^\n]*")
"""A comment of OBJ and OFF, also right behind a number, but not in 1.#INF: so Windows wrote infinity."""

COUNT = re.compile(r"[0-9]{1,18}")
"""A count in a header. More digits than these are no count of anything."""

_MOST = 2**62


def refusal(
    code: str, rule: str, found: str, place: str, advice: str = "Export or download the file again."
) -> InvalidMesh:
    """An InvalidMesh to raise, with the advice that fits most damaged files."""
    return InvalidMesh(code, rule, found, place=place, advice=advice)


def shown(text: str) -> str:
    """What the file has, quoted for a message, and never longer than a line."""
    return repr(text if len(text) <= 40 else text[:37] + "...")


def decode(data: bytes, place: str, first_line: int = 1) -> str:
    """UTF-8 text whose lines end in a line feed, whatever ended them in the file (LF, CRLF or CR)."""
    bad = None
    try:
        text = data.decode()
    except UnicodeDecodeError as error:
        bad = error.start
    else:
        if len(data.translate(None, CONTROL_BYTES)) != len(data):
            bad = next(at for at, byte in enumerate(data) if byte in CONTROL_BYTES)
    if bad is None:
        return _line_feeds(text)
    line = first_line + _line_feeds(data[:bad].decode()).count("\n")
    found, advice = f"it has byte 0x{data[bad]:02x}", "Save the file as UTF-8, or export it again."
    raise refusal("bad-encoding", "the text is UTF-8", found, f"{place}:{line}", advice)


def _line_feeds(text: str) -> str:
    return text.replace("\r\n", "\n").replace("\r", "\n")


def reals(words: list[str]) -> list[float]:
    """Decimal numbers, also nan and inf. ValueError where a word is none of them."""
    _refuse_python_only(words)
    return list(map(float, words))


def integers(words: list[str]) -> Int64[np.ndarray, " N"]:
    """Decimal integers, ValueError where a word is none; beyond 2**62 they count as 2**62, out of any range."""
    _refuse_python_only(words)
    values = list(map(int, words))
    try:
        return np.array(values, dtype=np.int64)
    except OverflowError:
        return np.array([max(-_MOST, min(_MOST, value)) for value in values], dtype=np.int64)


def _refuse_python_only(words: list[str]) -> None:
    """Python reads 1_000 and the digits of other scripts; no mesh format has them."""
    joined = "".join(words)
    if "_" in joined or not joined.isascii():
        raise ValueError("not a number of a mesh file")


def first_refused(parse: Callable[[list[str]], object], words: list[str]) -> int:
    """Position of the first word that `parse` refuses, after it refused the whole list; found by halving."""
    first, end = 0, len(words)
    while end - first > 1:
        middle = (first + end) // 2
        try:
            parse(words[first:middle])
        except ValueError:
            end = middle
        else:
            first = middle
    return first


def check_vertex_columns(columns: list[str], place: str) -> None:
    """At least three columns, and what follows the third (weight, colour, normal) is numbers too."""
    if len(columns) < 3:
        raise refusal("bad-line", "a vertex has three coordinates", f"the line has {len(columns)}", place)
    check_numeric(columns[3:], place)


def check_numeric(columns: list[str], place: str) -> None:
    """Columns behind the coordinates or corners are numbers; anything else is two lines run together, or garbage."""
    try:
        reals(columns)
    except ValueError:
        found = f"the line goes on with {shown(columns[first_refused(reals, columns)])}"
        raise refusal("bad-line", "extra columns are numbers", found, place) from None


def coordinates(words: list[str], lines: list[int], place: str) -> Float64[np.ndarray, "V 3"]:
    """Three words a vertex; `lines` has the line of every vertex."""
    try:
        vertices = np.array(reals(words), dtype=np.float64).reshape(-1, 3)
    except ValueError:
        bad = first_refused(reals, words)
        rule, found = "a coordinate is a decimal number", f"the line has {shown(words[bad])}"
        raise refusal(
            "bad-number", rule, found, f"{place}:{lines[bad // 3]}", "Write numbers like -0.5 or 1e-3."
        ) from None
    check_finite(vertices, lambda vertex: f"{place}:{lines[vertex]}")
    return vertices


def check_finite(vertices: Float64[np.ndarray, "V 3"], where: Callable[[int], str]) -> None:
    """No coordinate is NaN or infinite; `where` gives the place of a vertex."""
    finite = np.isfinite(vertices)
    if not finite.all():
        vertex, axis = map(int, np.argwhere(~finite)[0])
        found = f"{'xyz'[axis]} of vertex {vertex + 1} is {vertices[vertex, axis]}"
        advice = "Repair the mesh where it was made."
        raise refusal("not-finite", "every coordinate is finite", found, where(vertex), advice)


def check_not_empty(vertices: int, polygons: int, place: str) -> None:
    """A mesh has vertices and faces; a point cloud or a line drawing is none."""
    if vertices == 0:
        raise refusal("no-vertices", "a mesh has vertices", "the file has none", place)
    if polygons == 0:
        found = f"the file has none, only vertices ({vertices})"
        raise refusal("no-faces", "a mesh has faces", found, place, "Export a surface, not points or lines.")


def check_sizes(sizes: Int64[np.ndarray, " P"], where: Callable[[int], str]) -> None:
    """Every polygon has three corners or more; `where` gives the place of a polygon."""
    if sizes.min() < 3:
        polygon = int(np.argmax(sizes < 3))
        found = f"face {polygon + 1} has {sizes[polygon]}"
        raise refusal("bad-face", "a face has at least three corners", found, where(polygon))


def check_indices(
    corners: Int64[np.ndarray, " C"], sizes: Int64[np.ndarray, " P"], vertices: int, where: Callable[[int], str]
) -> None:
    """Every corner names a vertex, counted from 0; `where` gives the place of a polygon."""
    outside = (corners < 0) | (corners >= vertices)
    if outside.any():
        corner = int(np.argmax(outside))
        polygon = polygon_of(corner, sizes)
        rule = f"a face index lies between 0 and the number of vertices less one ({vertices - 1})"
        found = f"face {polygon + 1} has index {corners[corner]}"
        raise refusal("index-out-of-range", rule, found, where(polygon))


def polygon_of(corner: int, sizes: Int64[np.ndarray, " P"]) -> int:
    """The polygon, from 0, that a position in the flat list of corners belongs to."""
    return int(np.searchsorted(np.cumsum(sizes), corner, side="right"))


def fan_mesh(
    vertices: Float64[np.ndarray, "V 3"], corners: Int64[np.ndarray, " C"], sizes: Int64[np.ndarray, " P"]
) -> RawMesh:
    """Cut every polygon into a fan from its first corner; polygon i has the next sizes[i] >= 3 of the corners."""
    triangles = sizes - 2
    face_source = np.repeat(np.arange(len(sizes)), triangles)
    first = (np.cumsum(sizes) - sizes)[face_source]
    step = np.arange(len(face_source)) - (np.cumsum(triangles) - triangles)[face_source]
    faces = corners[np.stack([first, first + step + 1, first + step + 2], axis=1)]
    return RawMesh(vertices=vertices, faces=faces, face_source=face_source, polygons=len(sizes))
