"""IntrA: labels in the last column, the boundary counts as aneurysm, official folds."""

import shutil
from collections import Counter

import pytest
from light import LIGHT
from shapes import grid, write_obj

from meshshard import open_dataset
from meshshard.errors import UsageError
from meshshard_prep.datasets import Draw, read_dataset
from meshshard_prep.run import run

SHEET = grid(4, 1)
"""Ten vertices in five pairs along x."""

LABELS = [1, 1, 2, 2, 0, 0, 0, 0, 0, 0]
"""Aneurysm, boundary, vessel."""

FOLD_SIZES = (23, 23, 23, 23, 24)


@pytest.fixture(scope="module")
def intra(tmp_path_factory):
    """116 segments; every fifth vessel has two."""
    root = tmp_path_factory.mktemp("intra")
    names = [f"AN{number}" + (f"-{1 + number % 2}" if number % 5 == 0 else "") for number in range(116)]
    for name in names:
        write_obj(root / "annotated" / "obj" / f"{name}_full.obj", *SHEET)
        write_table(root / "annotated" / "ad" / f"{name}-_norm.ad")
    start = 0
    (root / "fileSplit" / "seg").mkdir(parents=True)
    for fold, size in enumerate(FOLD_SIZES):
        lines = [f"annotated/ad/{name}-_norm.ad\n" for name in names[start : start + size]]
        (root / "fileSplit" / "seg" / f"annSplit_{fold}.txt").write_text("".join(lines))
        start += size
    # what else is in the archive has no labels
    write_obj(root / "generated" / "vessel" / "obj" / "other.obj", *SHEET)
    return root


def write_table(path, labels=LABELS):
    path.parent.mkdir(parents=True, exist_ok=True)
    rows = [(*point, 0.0, 0.0, 1.0, label) for point, label in zip(SHEET[0].tolist(), labels, strict=True)]
    path.write_text("".join(" ".join(map(str, row)) + "\n" for row in rows))


def test_the_whole_of_it(intra):
    dataset = read_dataset("intra", intra)
    assert dataset.notes == ()
    assert (dataset.classes, len(dataset.entries)) == (("vessel", "aneurysm"), 116)
    groups = {entry.id: entry.group for entry in dataset.entries}
    assert (groups["AN5-2"], groups["AN7"]) == ("AN5", "AN7")


def test_a_fold_that_is_no_text_names_no_mesh(intra, tmp_path):
    shutil.copytree(intra, tmp_path / "intra")
    (tmp_path / "intra" / "fileSplit" / "seg" / "annSplit_0.txt").write_bytes(b"\xff\xfe")
    dataset = read_dataset("intra", tmp_path / "intra")
    assert len(dataset.entries) == 116 - FOLD_SIZES[0]
    assert any("is in no fold" in note for note in dataset.notes)


@pytest.mark.parametrize("fold", range(5))
def test_the_fold_that_is_asked_for_is_test(intra, fold):
    dataset = read_dataset("intra", intra, draw=Draw(fold=fold))
    assert Counter(dataset.splits.values()) == {"test": FOLD_SIZES[fold], "train": 116 - FOLD_SIZES[fold]}
    listed = (intra / "fileSplit" / "seg" / f"annSplit_{fold}.txt").read_text().split()
    assert {f"annotated/ad/{name}-_norm.ad" for name, split in dataset.splits.items() if split == "test"} == set(
        listed
    )
    assert dataset.split_rule == f"fold {fold} of 5 is test, the others train"


def test_another_fold_is_refused(intra):
    with pytest.raises(UsageError, match="intra has the folds 0 to 4; --fold is one of them, not 5"):
        read_dataset("intra", intra, draw=Draw(fold=5))


def test_vertices_are_labelled_as_published_and_the_boundary_is_aneurysm(intra, tmp_path):
    dataset = read_dataset("intra", intra)
    one = type(dataset)(name="one", task=dataset.task, classes=dataset.classes, entries=dataset.entries[:1])
    assert run(one, tmp_path / "out", LIGHT, jobs=1).ok
    (sample,) = open_dataset(tmp_path / "out")
    assert (sample.label_domain, sample.label_rule, sample.face_labels) == ("vertex", "", None)
    assert sample.vertex_labels.tolist() == [1, 1, 1, 1, 0, 0, 0, 0, 0, 0]


def test_what_is_missing_is_told_by_name(intra):
    path = intra / "annotated" / "obj" / "AN7_full.obj"
    path.rename(path.with_name("AN777_full.obj"))
    try:
        assert read_dataset("intra", intra).notes == (
            "missing meshes: AN7",
            "AN777_full is in no fold, and was not read",
            "intra has 116 meshes, and 115 were found",
        )
    finally:
        path.with_name("AN777_full.obj").rename(path)


def test_without_the_repositorys_lists_it_says_where_they_are(tmp_path):
    write_obj(tmp_path / "annotated" / "obj" / "AN1_full.obj", *SHEET)
    with pytest.raises(UsageError, match=r"annSplit_0.txt is not there; the folds of IntrA are in its repository"):
        read_dataset("intra", tmp_path)
    for fold in range(5):
        (tmp_path / "fileSplit" / "seg").mkdir(parents=True, exist_ok=True)
        (tmp_path / "fileSplit" / "seg" / f"annSplit_{fold}.txt").write_text("annotated/ad/AN1-_norm.ad\n")
    (tmp_path / "annotated" / "obj" / "AN1_full.obj").unlink()
    with pytest.raises(UsageError, match="not in the layout of IntrA"):
        read_dataset("intra", tmp_path)
