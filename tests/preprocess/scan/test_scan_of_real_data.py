"""Data sets as they were published, scanned as if nobody knew them; labels against a parse of another road."""

from collections import Counter

import numpy as np
import pytest
from scanned import scanned

from meshshard_prep.datasets import read_dataset
from meshshard_prep.formats import read_mesh
from meshshard_prep.labels import read_labels

pytestmark = pytest.mark.data


@pytest.mark.parametrize("name", ["", "chairs", "tele-aliens"])
def test_the_sample_of_coseg(data_root, tmp_path, capsys, name):
    toml, found = scanned(data_root / "coseg_sample" / name, tmp_path, capsys)
    meshes = {"": 27, "chairs": 22, "tele-aliens": 5}[name]
    assert found["labels"][0]["fits"] == {"face": meshes, "edge": 0, "vertex": 0}
    assert (found["known"], found["like"]) == ("", "" if name else "coseg_original")
    assert (len(found["edits"]), len(found["sets"])) == ((0, 0) if name else (1, 2))
    dataset = read_dataset(str(toml))
    assert len(dataset.classes) == {"": 7, "chairs": 3, "tele-aliens": 4}[name]
    assert set(dataset.splits.values()) == {"train", "val", "test"}
    for entry in dataset.entries:
        file = entry.path.parents[1] / "gt" / f"{entry.path.stem}.seg"
        labels = read_labels(entry.labels, entry.labels.path.read_bytes(), read_mesh(entry.path)).faces
        prefix = "" if name else f"{entry.path.parents[1].name} "
        assert [dataset.classes[label] for label in labels] == [
            f"{prefix}{line}" for line in file.read_text().split()
        ]


def test_modelnet_like_folders(data_root, tmp_path, capsys):
    toml, found = scanned(data_root / "modelnet9", tmp_path, capsys)
    assert (found["edits"], found["splits"]) == ([], {"test": 36, "train": 144})
    dataset = read_dataset(str(toml))
    assert Counter(dataset.classes[entry.mesh_label] for entry in dataset.entries) == dict.fromkeys(
        dataset.classes, 20
    )
    for entry in dataset.entries:
        assert [dataset.classes[entry.mesh_label], entry.split] == entry.source.split("/")[:2]


def test_human_bodies_as_if_unknown(data_root, tmp_path, capsys):
    known = read_dataset("human_seg", data_root / "human_seg").entries[::20]
    for entry in known:
        for path in (entry.path, entry.labels.path):
            link = tmp_path / "raw" / path.relative_to(data_root / "human_seg")
            link.parent.mkdir(parents=True, exist_ok=True)
            link.symlink_to(path.resolve())
    toml, found = scanned(tmp_path / "raw", tmp_path, capsys)
    assert (found["known"], found["edits"], found["meshes"]) == ("", [], 20)
    assert found["labels"][0]["fits"] == {"face": 0, "edge": 20, "vertex": 0}
    as_found = {entry.source: entry for entry in read_dataset(str(toml)).entries}
    for entry in known:
        mesh, data, other = read_mesh(entry.path), entry.labels.path.read_bytes(), as_found[entry.source]
        faces = [read_labels(labels, data, mesh).faces for labels in (entry.labels, other.labels)]
        np.testing.assert_array_equal(*faces)
        assert other.split == entry.split


def test_shapes_of_shrec(data_root, tmp_path, capsys):
    toml, found = scanned(data_root / "shrec_16", tmp_path, capsys)
    assert (found["known"], found["edits"], found["splits"]) == ("shrec_16", [], {"test": 120, "train": 480})
    dataset, known = read_dataset(str(toml)), read_dataset("shrec_16", data_root / "shrec_16")
    assert {(e.source, e.split, e.mesh_label) for e in dataset.entries} == {
        (e.source, e.split, e.mesh_label) for e in known.entries
    }


def test_nasty_files(data_root, tmp_path, capsys):
    toml, found = scanned(data_root / "mesh_corpus", tmp_path, capsys)
    assert found["meshes"] == len(read_dataset(str(toml)).entries) == 321
    assert sum(found["formats"].values()) + len(found["no_meshes"]) == 321
