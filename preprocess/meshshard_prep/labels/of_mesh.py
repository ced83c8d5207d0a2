"""Labels of a mesh: a label for every face, edge or vertex of its file. Which of them is found by count."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Int16, Int64

from meshshard.errors import InvalidMesh
from meshshard_prep.features.edges import edges_of
from meshshard_prep.labels.forms import FORMS
from meshshard_prep.labels.label_file import LabelFile
from meshshard_prep.mesh import RawMesh

PLURAL = {"face": "faces", "edge": "edges", "vertex": "vertices"}


@dataclass(frozen=True, eq=False, kw_only=True)
class Labels:
    """Class indices of a mesh's triangles or of its vertices (-1 unlabelled). `domain`: what the file counted;
    `rule`: how that became what is here, empty where it did not change."""

    domain: str
    rule: str = ""
    faces: Int16[np.ndarray, " F"] | None = None
    vertices: Int16[np.ndarray, " V"] | None = None


def read_labels(file: LabelFile, data: bytes, mesh: RawMesh) -> Labels:
    """The labels in the bytes of a label file, for the triangles or vertices of its mesh. InvalidMesh: what is no
    label, or a count that does not fit the mesh."""
    place = file.path.name
    written = FORMS[file.form](data, file.name, place)
    domains = (written.domain,) if written.domain else file.domains
    return labels_of(mesh, written.classes(file.classes), domains, place)


def labels_of(mesh: RawMesh, lines: Int64[np.ndarray, " L"], domains: tuple[str, ...], place: str) -> Labels:
    """Class indices as a label file lists them, as labels of triangles or vertices.

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
