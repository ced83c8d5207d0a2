"""How many vertices and faces a mesh file has, as far as can be told without reading them one by one."""

import codecs
import re
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from meshshard.errors import InvalidMesh
from meshshard_prep.features.edges import edges_of
from meshshard_prep.formats import format_of, parse_mesh, read_mesh
from meshshard_prep.formats.ply_header import read_header

_STATEMENT = {name: re.compile(rf"(?:^|\r)[ \t]*{name}[ \t]".encode(), re.MULTILINE) for name in ("v", "f")}
_OFF_COUNTS = re.compile(rb"(?:\s|#[^\r\n]*)*[A-Za-z0-9]*?OFF(?:\s|#[^\r\n]*)*(\d+)[ \t]+(\d+)")


@dataclass(frozen=True, kw_only=True)
class Counts:
    """`format`: "OBJ", "OFF" or "PLY", by content; `vertices` and `faces` (polygons) as the header or the beginnings
    of lines say. Of a file that is no mesh, `refusal` says why, and the counts are 0."""

    path: Path
    format: str = ""
    vertices: int = 0
    faces: int = 0
    refusal: str = ""

    @cached_property
    def edges(self) -> int:
        """How many edges the triangles have, for which the file is read; 0 where it cannot be read or has other
        polygons, whose edges nobody labels."""
        try:
            mesh = read_mesh(self.path)
        except InvalidMesh:
            return 0
        return len(edges_of(mesh.faces).ends) if mesh.polygons == len(mesh.faces) else 0

    def fits(self, labels: int) -> tuple[str, ...]:
        """What as many labels may belong to. Edges are counted only where faces do not fit: that takes a while."""
        quick = tuple(
            domain for domain, count in (("face", self.faces), ("vertex", self.vertices)) if count == labels
        )
        if "face" in quick or labels < max(self.vertices, self.faces):  # a surface has more edges
            return quick
        return (*quick, "edge") if labels == self.edges else quick


def counts_of(path: Path, data: bytes) -> Counts:
    """The counts of a mesh file from its bytes."""
    try:
        kind = format_of(data, path.name, path.suffix)
        data = data.removeprefix(codecs.BOM_UTF8)
        if kind == "OBJ":
            vertices, faces = (len(_STATEMENT[name].findall(data)) for name in ("v", "f"))
        elif kind == "PLY":
            header = read_header(data, path.name)
            vertices, faces = header.rows("vertex"), header.rows("face")
        elif match := _OFF_COUNTS.match(data):
            vertices, faces = int(match[1]), int(match[2])
        else:
            mesh = parse_mesh(data, path.name, path.suffix)  # says what is wrong with its header
            vertices, faces = len(mesh.vertices), mesh.polygons
        if vertices + faces > len(data):
            parse_mesh(data, path.name, path.suffix)  # the header promises more than there can be
    except InvalidMesh as error:
        return Counts(path=path, refusal=str(error))
    return Counts(path=path, format=kind, vertices=vertices, faces=faces)
