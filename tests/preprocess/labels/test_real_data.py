"""Labels as they were published: what becomes of them on the way to faces and back."""

import numpy as np
import pytest

from meshshard_prep.datasets import read_dataset
from meshshard_prep.features.edges import edges_of
from meshshard_prep.formats import parse_mesh
from meshshard_prep.labels import FORMS, listed
from meshshard_prep.labels.convert import faces_to_edges, two_of_three


@pytest.mark.data
def test_edges_of_human_seg_to_faces_and_back(data_root):
    dataset = read_dataset("human_seg", data_root / "human_seg")
    count = same = inside = same_inside = 0
    for entry in dataset.entries[::10]:
        mesh = parse_mesh(entry.path.read_bytes(), entry.source)
        published, _ = listed(entry.labels, entry.labels.path.read_bytes(), mesh)
        edges = edges_of(mesh.faces)
        faces = two_of_three(published[edges.of_face])
        again = faces_to_edges(faces, edges.of_face, len(edges.ends))
        interior, halves = edges.pairs
        sides = faces[halves // 3]
        agreeing = interior[sides[:, 0] == sides[:, 1]]
        count += len(again)
        same += int((again == published).sum())
        inside += len(agreeing)
        same_inside += int((again[agreeing] == published[agreeing]).sum())
    # docs/labels.md quotes both, of all meshes
    assert same / count == pytest.approx(0.968, abs=0.002)
    assert same_inside / inside > 0.999


@pytest.mark.data
@pytest.mark.parametrize("shape", ["chairs", "tele-aliens"])
def test_coseg_has_a_line_for_each_face(shape, data_root):
    for path in sorted((data_root / "coseg_sample" / shape / "shapes").glob("*.off"))[:4]:
        mesh = parse_mesh(path.read_bytes(), path.name)
        label_file = path.parents[1] / "gt" / f"{path.stem}.seg"
        found = FORMS["lines"](label_file.read_bytes(), "", "")
        assert len(found.which) == mesh.polygons
        written = [found.values[number] for number in found.which]
        np.testing.assert_array_equal(written, [int(line) for line in label_file.read_text().split()])
        assert min(written) >= 1
