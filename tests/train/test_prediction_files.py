"""Label files: a line for each polygon of the mesh file, whatever was cut, dropped or reordered."""

import numpy as np
import pytest
from samples import sample

from meshshard_train.prediction_files import write_labels


@pytest.mark.parametrize(
    ("face_source", "labels", "lines"),
    [
        ([0, 1, 2, 3], [2, 0, 1, 0], ["2", "0", "1", "0"]),
        ([0, 0, 0, 1, 2, 2, 3], [1, 2, 2, 0, 2, 1, 0], ["2", "0", "1", "0"]),  # the commonest, the lowest of equals
        ([1, 3], [2, 0], ["-1", "2", "-1", "0"]),  # a step left out the others
    ],
)
def test_a_line_for_each_polygon(tmp_path, face_source, labels, lines):
    rows = {"faces": sample().faces, "face_adjacency": sample().face_adjacency, "face_labels": sample().face_labels}
    cut = {name: array[: len(labels)] for name, array in rows.items()}
    mesh = sample(face_source=np.array(face_source, dtype="i4"), polygons=4, **cut)
    write_labels(tmp_path / "a.seg", mesh, np.array(labels))
    assert (tmp_path / "a.seg").read_text().splitlines() == lines
