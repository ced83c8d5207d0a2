"""Label files: a line for each polygon of the mesh file, or for each triangle of what was simplified."""

from dataclasses import replace

import numpy as np
import pytest
from samples import PAPER, sample

from meshshard.label_lines import as_lines, line_labels, most_common


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
