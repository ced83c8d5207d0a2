"""The Princeton benchmark: nineteen folders, parts by name, faces counted from 1."""

from collections import Counter

import pytest
from light import LIGHT
from shapes import box, write_off

from meshshard import open_dataset
from meshshard.errors import UsageError
from meshshard_prep.datasets import ADAPTERS, read_dataset
from meshshard_prep.datasets.psb import FIRST
from meshshard_prep.run import run

BOX = box()


def write_mesh(folder, number, parts=("head", "body")):
    write_off(folder / f"{number}.off", *BOX)
    shares = [" ".join(str(face + 1) for face in range(12) if face % len(parts) == n) for n in range(len(parts))]
    text = "".join(f"{part}\n{faces}\n" for part, faces in zip(parts, shares, strict=True))
    (folder / f"{number}_labels.txt").write_text(text)


@pytest.fixture(scope="module")
def psb(tmp_path_factory):
    root = tmp_path_factory.mktemp("psb")
    for kind, first in FIRST.items():
        for number in range(first, first + 20):
            write_mesh(root / kind, number, ("head", "body") if kind in ("Bird", "Human") else ("side", "top", "end"))
    return root


def test_the_whole_of_it(psb):
    dataset = read_dataset("psb", psb)
    assert dataset.notes == ()
    assert len(dataset.entries) == 380
    assert len(dataset.classes) == 2 * 2 + 17 * 3
    assert "Bird head" in dataset.classes
    assert "Human head" in dataset.classes
    splits = Counter((name.split("/")[0], split) for name, split in dataset.splits.items())
    assert splits == {(kind, split): n for kind in FIRST for split, n in (("train", 12), ("test", 8))}


@pytest.mark.parametrize("kind", sorted(FIRST))
def test_each_class_by_itself(psb, kind):
    dataset = read_dataset(f"psb_{kind.lower()}", psb)
    assert dataset.notes == ()
    assert dataset.classes == (("body", "head") if kind in ("Bird", "Human") else ("end", "side", "top"))
    assert Counter(dataset.splits.values()) == {"train": 12, "test": 8}


def test_there_is_a_name_for_each_of_nineteen_classes_and_none_for_springs():
    assert len([name for name in ADAPTERS if name.startswith("psb_")]) == len(FIRST) == 19
    numbers = {first + place for first in FIRST.values() for place in range(20)}
    assert numbers == set(range(1, 401)) - set(range(261, 281))


def test_parts_are_stored(tmp_path):
    for number in (241, 242):
        write_mesh(tmp_path / "raw" / "Bird", number)
    write_mesh(tmp_path / "raw" / "Human", 1)
    dataset = read_dataset("psb", tmp_path / "raw")
    assert run(dataset, tmp_path / "out", LIGHT, jobs=1).ok
    labels = {sample.id: sample.face_labels.tolist() for sample in open_dataset(tmp_path / "out")}
    assert dataset.classes == ("Bird body", "Bird head", "Human body", "Human head")
    assert labels == {"Bird/241": [1, 0] * 6, "Bird/242": [1, 0] * 6, "Human/1": [3, 2] * 6}


def test_missing_classes_and_meshes_are_told_by_name(tmp_path):
    for number in (241, 243):
        write_mesh(tmp_path / "Bird", number)
    whole, bird = read_dataset("psb", tmp_path), read_dataset("psb_bird", tmp_path)
    assert whole.notes[0].startswith("missing classes: Airplane, Ant, Armadillo")
    assert whole.notes[1:] == (
        "missing meshes of Bird: 242, 244, 245, 246, 247, 248, 249, 250, 251, 252 and 8 more",
        "psb has 380 meshes, and 2 were found",
    )
    assert bird.notes == (whole.notes[1], "psb_bird has 20 meshes, and 2 were found")


@pytest.mark.parametrize("name", ["psb", "psb_bird"])
def test_another_layout_is_refused(tmp_path, name):
    write_mesh(tmp_path / "birds", 241)
    with pytest.raises(UsageError, match="not in the layout of the Princeton benchmark"):
        read_dataset(name, tmp_path)
