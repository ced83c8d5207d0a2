"""The formats `seg` and `eseg`: the labels of a data set in the field's text files, one integer a line."""

import numpy as np
from jaxtyping import Int

from meshshard import Dataset, InvalidMesh, Sample, UsageError
from meshshard.export import Exporter
from meshshard.label_lines import as_lines, line_labels, line_note
from meshshard.recipe import Recipe
from meshshard_prep.features.edges import edges_of
from meshshard_prep.labels.convert import faces_to_edges


def seg(dataset: Dataset) -> Exporter:
    """The format `seg`. UsageError: the data set has no labels of faces or vertices."""
    _check(dataset)
    recipe = dataset.recipe
    note = line_note(recipe, "vertex" if _of_vertices(dataset) else "face")
    return Exporter(".seg", lambda sample: as_lines(labels_of_file(sample, recipe)), note)


def eseg(dataset: Dataset) -> Exporter:
    """The format `eseg`. UsageError: the data set has no labels of faces."""
    _check(dataset)
    if _of_vertices(dataset):
        raise UsageError(
            f"{dataset.folder} has labels of vertices, and those of edges are made from labels of faces; "
            "try --to seg, which writes a line for each vertex"
        )
    return Exporter(".eseg", lambda sample: as_lines(labels_of_edges(sample)), line_note(dataset.recipe, "edge"))


def _of_vertices(dataset: Dataset) -> bool:
    return len(dataset) > 0 and dataset[0].face_labels is None and dataset[0].vertex_labels is not None


def _check(dataset: Dataset) -> None:
    if dataset.task != "segmentation":
        raise UsageError(f"{dataset.folder} has no labels of faces or vertices, which is all that these files hold")


def labels_of_file(sample: Sample, recipe: Recipe) -> Int[np.ndarray, " L"]:
    """Class index of each face by the rule of `line_labels`; or of each stored vertex, where vertices are labelled.
    -1 is unlabelled. InvalidMesh: no labels."""
    if sample.face_labels is None:
        if sample.vertex_labels is None:
            raise _without(sample, "faces or vertices")
        return sample.vertex_labels
    return line_labels(sample, sample.face_labels, recipe)


def labels_of_edges(sample: Sample) -> Int[np.ndarray, " E"]:
    """Label of each edge in MeshCNN's order: class index + 1, by `faces_to_edges`; -1 is unlabelled.

    InvalidMesh: the mesh file has faces of more than three corners, or none is labelled.
    """
    if sample.face_labels is None:
        raise _without(sample, "faces")
    if sample.vertex_source is None and sample.polygons != len(sample.faces):
        raise InvalidMesh(
            "not-triangles",
            "edges are labelled in meshes of triangles",
            f"the mesh file has {sample.polygons} faces, which were cut into {len(sample.faces)} triangles",
            place=sample.id,
            advice="try --to seg, which writes a label for each face",
        )
    edges = edges_of(sample.faces.astype(np.int64))
    labels = faces_to_edges(sample.face_labels, edges.of_face, len(edges.ends))
    return np.where(labels < 0, -1, labels + 1)


def _without(sample: Sample, what: str) -> InvalidMesh:
    rule = f"the file holds the labels of {what}"
    return InvalidMesh(
        "no-labels", rule, "this mesh has none", place=sample.id, advice="take it out with --split or --id"
    )
