"""Labels of a mesh: a label for every face, edge or vertex of its file. Which of them is found by count."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Int16, Int64

from meshshard.errors import InvalidMesh
from meshshard_prep.features.edges import edges_of
from meshshard_prep.labels.convert import (
    EDGES_TO_FACES,
    FACES_TO_VERTICES,
    VERTICES_TO_FACES,
    faces_to_vertices,
    two_of_three,
)
from meshshard_prep.labels.forms import FORMS
from meshshard_prep.labels.label_file import LabelFile
from meshshard_prep.labels.written import UNLABELLED, Written, bad_label
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
    lines, domains = listed(file, data, mesh)
    return labels_of(mesh, lines, domains, file.path.name, file.to)


def listed(file: LabelFile, data: bytes, mesh: RawMesh) -> tuple[Int64[np.ndarray, " L"], tuple[str, ...]]:
    """The class indices that the bytes of a label file list, and the domains that they may be of. InvalidMesh: what
    is no label, or is of a domain or a face that it cannot be of."""
    place = file.path.name
    written = FORMS[file.form](data, file.name, place)
    lines = written.classes(file.classes)
    if written.domain and written.domain not in file.domains:
        raise bad_label(
            f"the labels are of {' or '.join(PLURAL[domain] for domain in file.domains)}",
            f"these are of {PLURAL[written.domain]}",
            place,
            "correct labels.domain in the data set's TOML file, or name other labels",
        )
    if written.numbers is not None:
        lines = _spread(written, lines, mesh.polygons)
    return lines, (written.domain,) if written.domain else file.domains


def _spread(written: Written, lines: Int64[np.ndarray, " L"], polygons: int) -> Int64[np.ndarray, " P"]:
    """Labels of all faces, from those of the faces that a file names."""
    numbers = written.numbers
    assert numbers is not None
    outside = numbers >= polygons
    if outside.any():
        first = int(np.argmax(outside))
        advice = "pair each mesh with the label file made for it"
        found = f"this is {numbers[first] + 1}"
        raise bad_label(f"faces are numbered from 1 to {polygons}", found, written.place(first), advice)
    result = np.full(polygons, UNLABELLED)
    result[numbers] = lines
    return result


def labels_of(
    mesh: RawMesh, lines: Int64[np.ndarray, " L"], domains: tuple[str, ...], place: str, to: str = ""
) -> Labels:
    """Class indices as a label file lists them, as labels of triangles or vertices.

    `domains` are those the layout allows, of "face", "edge" and "vertex"; the one with the right count is meant.
    Face labels go to the triangles cut from the face. Labels of edges become those of triangles. `to`, "face" or
    "vertex", converts the labels by the rules of `labels.convert`. Edge labels are for meshes of triangles only.
    InvalidMesh where no count fits, or two do.
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
            f"a label file has one label for each of the mesh's {expected}",
            f"it has {len(lines)}",
            place=place,
            advice="say labels.domain in the data set's TOML file"
            if fits
            else "pair each mesh with the label file made for it",
        )
    if fits == ["vertex"]:
        if to != "face":
            return Labels(domain="vertex", vertices=lines.astype(np.int16))
        of_faces = two_of_three(lines[mesh.faces])
        return Labels(domain="vertex", rule=VERTICES_TO_FACES, faces=of_faces.astype(np.int16))
    rules = []
    if fits == ["edge"]:
        lines = two_of_three(lines[edges.of_face])
        rules.append(EDGES_TO_FACES)
    if to == "vertex":
        of_vertices = faces_to_vertices(lines, mesh.faces, mesh.face_source, len(mesh.vertices))
        rule = "; then ".join([*rules, FACES_TO_VERTICES])
        return Labels(domain=fits[0], rule=rule, vertices=of_vertices.astype(np.int16))
    return Labels(domain=fits[0], rule="".join(rules), faces=lines[mesh.face_source].astype(np.int16))
