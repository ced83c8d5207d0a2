"""Label files: one integer a line, for every face, edge or vertex. Which of them is found by count."""

import codecs
import contextlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Int16, Int64

from meshshard.errors import InvalidMesh, UsageError
from meshshard_prep.features.edges import edges_of
from meshshard_prep.mesh import RawMesh

UNLABELLED = -1
MOST_CLASSES = 2**15
"""Labels are stored in 16 bits."""

PLURAL = {"face": "faces", "edge": "edges", "vertex": "vertices"}


@dataclass(frozen=True, eq=False, kw_only=True)
class Labels:
    """Class indices of a mesh's triangles or of its vertices (-1 unlabelled), and what the file counted."""

    domain: str
    faces: Int16[np.ndarray, " F"] | None = None
    vertices: Int16[np.ndarray, " V"] | None = None


def parse_labels(data: bytes, classes: Mapping[int, int], place: str) -> Int64[np.ndarray, " L"]:
    """Class index of each line; `classes` maps the integers of the file to class indices.

    -1 is unlabelled. InvalidMesh: a line that is no integer, or an integer that is no class. Empty lines may only end
    the file.
    """
    classes = {**classes, UNLABELLED: UNLABELLED}
    result = []
    for number, line in enumerate(data.removeprefix(codecs.BOM_UTF8).rstrip().splitlines(), start=1):
        try:
            result.append(classes[_integer(line)])
        except (ValueError, KeyError):
            raise InvalidMesh(
                "bad-label",
                f"each line is one of the integers {', '.join(map(str, sorted(classes)))}",
                f"this one is {line[:40].decode(errors='replace')!r}",
                place=f"{place}:{number}",
                advice="correct the line; -1 says unlabelled",
            ) from None
    return np.array(result, dtype=np.int64)


def _integer(line: bytes) -> int:
    """A decimal integer; ValueError for what is none, also for 1_0, which Python would take."""
    if b"_" in line:
        raise ValueError(line)
    return int(line)


def labels_of(mesh: RawMesh, lines: Int64[np.ndarray, " L"], domains: tuple[str, ...], place: str) -> Labels:
    """Lines of a label file as labels of triangles or vertices.

    `domains` are those the layout allows, of "face", "edge" and "vertex"; the one with the right count is meant.
    Face labels go to the triangles cut from the face. A triangle takes the label that at least two of its three
    edges have, -1 where all three differ. Edge labels are for meshes of triangles only. InvalidMesh where no count
    fits, or two do.
    """
    counts = {"face": mesh.polygons, "vertex": len(mesh.vertices)}
    if mesh.polygons != len(mesh.faces):
        # an edge label would be held against the diagonals of the triangulation too
        domains = tuple(domain for domain in domains if domain != "edge") or ("face",)
    if "edge" in domains:
        edges = edges_of(mesh.faces)
        counts["edge"] = len(edges.ends)
    fits = [domain for domain in domains if counts[domain] == len(lines)]
    if len(fits) != 1:
        expected = " or ".join(f"{counts[domain]} ({PLURAL[domain]})" for domain in domains)
        raise InvalidMesh(
            "label-count",
            f"a label file has one line for each of the mesh's {expected}",
            f"it has {len(lines)} lines",
            place=place,
            advice="say label_domain in the data set's TOML file"
            if fits
            else "pair each mesh with the label file made for it",
        )
    if fits == ["vertex"]:
        return Labels(domain="vertex", vertices=lines.astype(np.int16))
    per_face = lines[mesh.face_source] if fits == ["face"] else majority_of_edges(lines[edges.of_face])
    return Labels(domain=fits[0], faces=per_face.astype(np.int16))


def majority_of_edges(sides: Int64[np.ndarray, "F 3"]) -> Int64[np.ndarray, " F"]:
    """The label at least two of three edges have, -1 where all three differ."""
    a, b, c = sides.T
    return np.where((a == b) | (a == c), a, np.where(b == c, b, -1))


def class_table(paths: list[Path], names: tuple[str, ...], place: Path) -> tuple[tuple[str, ...], dict[int, int]]:
    """Class names, and integer -> class index, from the distinct integers of label files, rising.

    `names` are the names to use, or empty: then the integers are. Lines that hold no integer are left to
    `parse_labels`, which refuses that mesh alone. UsageError where names and integers differ in number.
    """
    values: set[int] = set()
    for path in paths:
        for line in set(path.read_bytes().removeprefix(codecs.BOM_UTF8).split()):
            with contextlib.suppress(ValueError):
                values.add(_integer(line))
    values.discard(UNLABELLED)
    if len(values) > MOST_CLASSES:
        raise UsageError(
            f"{place}: the label files hold {len(values)} distinct integers, and a data set has {MOST_CLASSES} "
            "classes at most; move files away that are no labels"
        )
    table = {value: number for number, value in enumerate(sorted(values))}
    if names and len(names) != len(table):
        raise UsageError(f"{place}: {len(names)} class names, but the label files hold the integers {sorted(values)}")
    return names or tuple(map(str, table)), table
