"""Deformed copies of training meshes, from the entries to the index."""

import json
from dataclasses import replace

import numpy as np
import pytest
from shapes import bumpy, write_labels, write_obj

from meshshard.dataset import open_dataset
from meshshard.errors import UsageError
from meshshard.recipe import RECIPES
from meshshard_prep.commands import status
from meshshard_prep.datasets import read_dataset
from meshshard_prep.datasets.copies import with_copies
from meshshard_prep.run import run
from meshshard_prep.splits import assign_splits


@pytest.fixture
def raw(tmp_path):
    for number in range(8):
        vertices, faces = bumpy(number, 1)
        path = tmp_path / "raw" / ("test" if number > 5 else "train") / f"{number}.obj"
        write_obj(path, vertices, faces)
        write_labels(path.with_suffix(".seg"), np.arange(len(faces)) % 3)
    return read_dataset(str(tmp_path / "raw"))


def test_only_training_meshes_have_copies_and_copies_go_with_them(raw):
    dataset = with_copies(raw, 2)
    assert len(dataset.entries) == 8 + 2 * 6
    assert dataset.split_rule == "as shipped; 2 deformed copies of each training mesh"
    for fraction, share in ((0.0, 1.0), (0.3, 1.0), (0.3, 0.5)):
        alone = assign_splits(raw, fraction=fraction, seed=0, train_fraction=share)
        splits = assign_splits(dataset, fraction=fraction, seed=0, train_fraction=share)
        assert {name: splits[name] for name in alone} == alone
        copies = {name: split for name, split in splits.items() if name not in alone}
        assert {name.partition("~")[0] for name in copies} == {name for name in alone if name.startswith("train/")}
        for name, split in copies.items():
            assert split == ("train" if alone[name.partition("~")[0]] == "train" else "")


def test_they_are_stored_with_the_labels_of_the_mesh_and_other_features(raw, tmp_path, monkeypatch, capsys):
    run(raw, tmp_path / "out", RECIPES["paper"], jobs=1)
    report = run(with_copies(raw, 1), tmp_path / "out", RECIPES["paper"], jobs=1)
    assert report.computed == 6  # the others were there
    dataset = open_dataset(tmp_path / "out")
    place = {name: number for number, name in enumerate(dataset.ids)}
    for name in [name for name in place if name.endswith("~deformed1")]:
        copy, mesh = dataset[place[name]], dataset[place[name.partition("~")[0]]]
        np.testing.assert_array_equal(copy.face_labels, mesh.face_labels)
        np.testing.assert_array_equal(copy.faces, mesh.faces)
        assert abs(copy.hks / mesh.hks - 1).max() > 0.01
        assert (copy.source, copy.source_sha256) == (mesh.source, mesh.source_sha256)
        assert copy.key != mesh.key
    monkeypatch.chdir(tmp_path)
    status("out", raw=tmp_path / "raw", as_json=True)
    assert json.loads(capsys.readouterr().out)["plan"]["fresh"] == 14
    assert run(raw, tmp_path / "out", RECIPES["paper"], jobs=1).removed == tuple(
        name for name in dataset.ids if "~" in name
    )


def test_copies_of_splits_that_are_drawn_are_in_train(raw):
    drawn = {entry.id: "train" if number < 3 else "test" for number, entry in enumerate(raw.entries)}
    dataset = with_copies(replace(raw, drawn=drawn), 1)
    assert {split for name, split in dataset.splits.items() if "~" in name} == {"train"}
    assert len(dataset.splits) == 8 + 3


def test_no_copies_and_no_training_meshes(raw):
    assert with_copies(raw, 0) is raw
    test = tuple(entry for entry in raw.entries if entry.split == "test")
    with pytest.raises(UsageError, match="--deformed is about meshes of train, and raw has no such split"):
        with_copies(replace(raw, entries=test), 1)
