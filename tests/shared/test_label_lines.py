"""Label files: a line for each polygon of the mesh file, or for each triangle of what was simplified."""

from dataclasses import replace

import numpy as np
import pytest
from samples import PAPER, sample

from meshshard.label_lines import as_lines, line_confidence, line_labels, line_note, most_common


@pytest.mark.parametrize(
    ("face_source", "labels", "lines"),
    [
        ([0, 1, 2, 3], [2, 0, 1, 0], b"2\n0\n1\n0\n"),
        ([0, 0, 0, 1, 2, 2, 3], [1, 2, 2, 0, 2, 1, 0], b"2\n0\n1\n0\n"),  # the commonest, the lowest of equals
        ([0, 0, 1, 2, 3, 3], [-1, 2, -1, 0, -1, -1], b"2\n-1\n0\n-1\n"),
        ([1, 3], [2, 0], b"-1\n2\n-1\n0\n"),  # a step left out the others
    ],
)
@pytest.mark.parametrize("steps", [(), ("weld", "largest_component", "orient")])
def test_a_line_for_each_polygon(face_source, labels, lines, steps):
    rows = {"faces": sample().faces, "face_adjacency": sample().face_adjacency, "face_labels": sample().face_labels}
    cut = {name: array[: len(labels)] for name, array in rows.items()}
    vertex_source = np.arange(len(sample().vertices), dtype="i4") if steps else None
    mesh = sample(face_source=np.array(face_source, dtype="i4"), polygons=4, vertex_source=vertex_source, **cut)
    assert as_lines(line_labels(mesh, np.array(labels), replace(PAPER, steps=steps))) == lines
    simplified = line_labels(mesh, np.array(labels), replace(PAPER, steps=steps, simplify=8))
    assert simplified.tolist() == labels


def test_ties_go_to_the_lowest_label_and_minus_one_does_not_count():
    owners = np.array([0, 0, 0, 0, 2, 2, 2, 3])
    labels = np.array([5, 2, 5, 2, -1, -1, 7, -1])
    assert most_common(owners, labels, 5).tolist() == [2, -1, 7, -1, -1]
    assert most_common(owners[:0], labels[:0], 2).tolist() == [-1, -1]


def test_a_line_is_as_probable_as_its_triangles_say():
    """A quad of two triangles that disagree, one of two that agree, a face that a step left out."""
    rows = {"faces": sample().faces, "face_adjacency": sample().face_adjacency, "face_labels": sample().face_labels}
    cut = {name: array[:4] for name, array in rows.items()}
    mesh = sample(face_source=np.array([0, 0, 2, 2], dtype="i4"), polygons=3, **cut)
    probabilities = np.array([[0.9, 0.1], [0.2, 0.8], [0.3, 0.7], [0.4, 0.6]])
    lines = line_labels(mesh, probabilities.argmax(axis=1), PAPER)
    assert lines.tolist() == [0, -1, 1]
    np.testing.assert_allclose(line_confidence(mesh, lines, probabilities, PAPER), [0.55, 0, 0.65])
    simplified = replace(PAPER, simplify=4)
    each = line_confidence(mesh, probabilities.argmax(axis=1), probabilities, simplified)
    np.testing.assert_allclose(each, [0.9, 0.8, 0.7, 0.6])


@pytest.mark.parametrize(
    ("steps", "simplify", "notes"),
    [
        ((), 0, ["", "", ""]),
        (("weld",), 0, ["", "of an edge of the stored mesh", "of a vertex of the stored mesh"]),
        ((), 8, ["of a face of the simplified mesh", "of an edge of the stored", "of a vertex of the stored"]),
    ],
)
def test_it_is_said_what_lines_are_of_where_they_are_not_of_the_file(steps, simplify, notes):
    recipe = replace(PAPER, steps=steps, simplify=simplify)
    for domain, note in zip(("face", "edge", "vertex"), notes, strict=True):
        said = line_note(recipe, domain)
        assert note in said
        assert bool(note) == bool(said)
