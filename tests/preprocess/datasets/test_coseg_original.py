"""COSEG as published: folders of many names, 1-based labels of faces, a drawn split, sets that are missing."""

from collections import Counter

import pytest
from light import LIGHT
from shapes import box, write_labels, write_off

from meshshard import open_dataset
from meshshard.errors import UsageError
from meshshard_prep.datasets import Draw, read_dataset
from meshshard_prep.run import run

BOX = box()


def write_set(folder, meshes, parts):
    for number in range(meshes):
        write_off(folder / "shapes" / f"{number + 1}.off", *BOX)
        write_labels(folder / "gt" / f"{number + 1}.seg", [1 + face % parts for face in range(12)])


@pytest.fixture(scope="module")
def coseg(tmp_path_factory):
    """All of it, small meshes for large; a MacOS archive's companions of files lie about."""
    root = tmp_path_factory.mktemp("coseg")
    for name, meshes, parts in (("Tele-aliens", 200, 4), ("Large_Chairs", 400, 3), ("vases", 300, 4)):
        write_set(root / name, meshes, parts)
        (root / name / "shapes" / "._1.off").write_bytes(b"\0\5\26\7")
    return root


def test_the_whole_of_it(coseg):
    whole = read_dataset("coseg_original", coseg)
    assert whole.notes == ()
    assert (len(whole.classes), len(whole.entries)) == (11, 900)
    assert Counter(whole.splits.values()) == {"train": 765, "test": 135}
    test = Counter(name.split("/")[0] for name, split in whole.splits.items() if split == "test")
    assert test == {"aliens": 30, "chairs": 60, "vases": 45}
    first = next(entry for entry in whole.entries if entry.id == "vases/1")
    assert first.source == "vases/shapes/1.off"
    assert first.labels.classes == {1: 7, 2: 8, 3: 9, 4: 10}


@pytest.mark.parametrize(("shape", "meshes"), [("aliens", 200), ("chairs", 400), ("vases", 300)])
def test_each_set_by_itself(coseg, shape, meshes):
    dataset = read_dataset(f"coseg_original_{shape}", coseg)
    assert dataset.notes == ()
    assert len(dataset.entries) == meshes
    assert Counter(dataset.splits.values())["train"] == round(0.85 * meshes)


def test_another_seed_draws_another_split_and_the_same_seed_the_same(coseg):
    splits = [read_dataset("coseg_original_vases", coseg, draw=Draw(seed=seed)).splits for seed in (0, 0, 1)]
    assert splits[0] == splits[1] != splits[2]


def test_labels_are_stored_from_0(tmp_path):
    write_set(tmp_path / "shapes", 0, 3)
    write_set(tmp_path, 4, 3)  # the folder of one set, named itself
    dataset = read_dataset("coseg_original_chairs", tmp_path)
    assert dataset.notes == ("coseg_original_chairs has 400 meshes, and 4 were found",)
    assert run(dataset, tmp_path / "out", LIGHT, jobs=1).ok
    for sample in open_dataset(tmp_path / "out"):
        assert sample.face_labels.tolist() == [0, 1, 2] * 4


def test_a_missing_set_is_told_and_keeps_its_classes(tmp_path):
    write_set(tmp_path / "chairs", 2, 3)
    dataset = read_dataset("coseg_original", tmp_path)
    assert dataset.notes[0] == "missing sets: aliens, vases"
    assert len(dataset.classes) == 11
    assert dataset.entries[0].labels.classes == {1: 4, 2: 5, 3: 6}


@pytest.mark.parametrize("name", ["coseg_original", "coseg_original_chairs"])
def test_another_layout_is_refused(tmp_path, name):
    write_off(tmp_path / "coseg_chairs" / "train" / "1.off", *BOX)
    with pytest.raises(UsageError, match="not in the layout of COSEG"):
        read_dataset(name, tmp_path)
