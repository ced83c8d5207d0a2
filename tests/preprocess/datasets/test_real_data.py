"""The data sets at hand, read whole; labels against a parse that shares no line with the project's."""

from collections import Counter

import numpy as np
import pytest

from meshshard_prep.datasets import Draw, read_dataset
from meshshard_prep.formats import parse_mesh
from meshshard_prep.labels import read_labels


@pytest.mark.data
def test_human_seg_labels(data_root):
    dataset = read_dataset("human_seg", data_root / "human_seg")
    assert dataset.notes == ()
    assert Counter(entry.split for entry in dataset.entries) == {"train": 381, "test": 18}
    assert len({entry.group for entry in dataset.entries if entry.split == "train"}) == 8 + 10 + 1 + 41
    open_faces = 0
    for entry in dataset.entries:
        mesh = parse_mesh(entry.path.read_bytes(), entry.source)
        found = read_labels(entry.labels, entry.labels.path.read_bytes(), mesh)
        assert found.domain == "edge"
        expected = labels_by_another_road(entry.path, entry.labels.path)
        np.testing.assert_array_equal(found.faces, expected, err_msg=entry.id)
        open_faces += int((found.faces < 0).sum())
    assert open_faces == 2  # of 598,500


def labels_by_another_road(mesh_path, label_path):
    """Face labels of MeshCNN's edge labels by a dictionary of edges and a counter."""
    edge_labels = [int(line) for line in label_path.read_text().split()]
    numbers, result = {}, []
    for line in mesh_path.read_text().splitlines():
        if line.startswith("f "):
            a, b, c = (int(part.split("/")[0]) for part in line.split()[1:])
            sides = [numbers.setdefault(frozenset(edge), len(numbers)) for edge in ((a, b), (b, c), (c, a))]
            label, votes = Counter(edge_labels[side] for side in sides).most_common(1)[0]
            result.append(label - 1 if votes > 1 else -1)
    assert len(numbers) == len(edge_labels)
    return result


@pytest.mark.data
def test_shrec_16(data_root):
    dataset = read_dataset("shrec_16", data_root / "shrec_16")
    assert dataset.notes == ()
    assert list(dataset.classes) == sorted(path.name for path in (data_root / "shrec_16").iterdir() if path.is_dir())
    assert Counter(entry.split for entry in dataset.entries) == {"train": 480, "test": 120}
    for entry in dataset.entries:
        assert dataset.classes[entry.mesh_label] == entry.path.parts[-3]
        assert parse_mesh(entry.path.read_bytes(), entry.source).polygons == 500


@pytest.mark.data
@pytest.mark.parametrize("train", [16, 10])
def test_shrec_16_redrawn(data_root, train):
    dataset = read_dataset(f"shrec11_split{train}", data_root / "shrec_16", draw=Draw(seed=7))
    assert dataset.notes == ()
    counts = Counter((entry.mesh_label, dataset.splits[entry.id]) for entry in dataset.entries)
    assert counts == {
        (label, split): n for label in range(30) for split, n in (("train", train), ("test", 20 - train))
    }
    shipped = read_dataset("shrec_16", data_root / "shrec_16").splits
    assert Counter(shipped[name] for name, split in dataset.splits.items() if split == "test")["train"] > 0


@pytest.mark.data
def test_coseg_sample_is_coseg_as_published(data_root):
    dataset = read_dataset("coseg_original", data_root / "coseg_sample")
    assert dataset.notes == ("missing sets: vases", "coseg_original has 900 meshes, and 27 were found")
    assert Counter(entry.id.split("/")[0] for entry in dataset.entries) == {"aliens": 5, "chairs": 22}
    for entry in dataset.entries:
        mesh = parse_mesh(entry.path.read_bytes(), entry.source, ".off")
        found = read_labels(entry.labels, entry.labels.path.read_bytes(), mesh)
        assert found.domain == "face"
        first = 0 if entry.id.startswith("aliens") else 4  # of the eleven classes
        lines = entry.labels.path.read_text().split()
        assert found.faces.tolist() == [int(line) - 1 + first for line in lines], entry.id
        assert len(lines) == int(entry.path.read_text().split()[2])  # faces, by the header
    seen = {int(word) for entry in dataset.entries for word in set(entry.labels.path.read_text().split())}
    assert seen == {1, 2, 3, 4}


@pytest.mark.data
def test_modelnet9_lacks_a_class_of_modelnet10_and_that_is_told(data_root):
    dataset = read_dataset("modelnet10", data_root / "modelnet9")
    assert dataset.notes == (
        "missing classes: toilet",
        "modelnet10 has 3991 train meshes, and 144 were found",
        "modelnet10 has 908 test meshes, and 36 were found",
    )
    assert {dataset.classes[entry.mesh_label] for entry in dataset.entries} == set(dataset.classes) - {"toilet"}
    assert all(dataset.classes[entry.mesh_label] == entry.path.parts[-3] for entry in dataset.entries)


@pytest.mark.data
def test_modelnet9_is_in_the_same_layout(data_root, tmp_path):
    file = tmp_path / "modelnet9.toml"
    file.write_text(f'layout = "meshcnn-classification"\nraw = "{(data_root / "modelnet9").resolve()}"\n')
    dataset = read_dataset(str(file))
    assert (len(dataset.classes), len(dataset.entries)) == (9, 180)
