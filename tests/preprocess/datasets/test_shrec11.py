"""SHREC11 in both forms: splits as shipped and redrawn, and the track's file of categories with its traps."""

from collections import Counter

import pytest
from light import LIGHT
from shapes import box, tetrahedron, write_obj, write_off

from meshshard import open_dataset
from meshshard.errors import UsageError
from meshshard_prep.datasets import Draw, read_dataset
from meshshard_prep.datasets.shrec11 import CLASSES
from meshshard_prep.run import run

SHAPE = tetrahedron()


def numbers_of(label):
    """Twenty meshes a class, spread as in the track: no class has a run of numbers."""
    return [(7 * (20 * label + place) + 3) % 600 for place in range(20)]


@pytest.fixture(scope="module")
def simplified(tmp_path_factory):
    root = tmp_path_factory.mktemp("shrec_16")
    for label, name in enumerate(CLASSES):
        for place, number in enumerate(numbers_of(label)):
            write_obj(root / name / ("train" if place < 16 else "test") / f"T{number}.obj", *SHAPE)
        (root / name / "train" / f"._T{label}.obj").write_bytes(b"\0\5\26\7")
        (root / name / "train" / "cache").mkdir()
        (root / name / "train" / "cache" / "T1_000.npz").write_bytes(b"PK")
    return root


@pytest.fixture(scope="module")
def dense(tmp_path_factory):
    """Meshes in a folder beside the categories; two classes have another name there, and another order."""
    root = tmp_path_factory.mktemp("shrec11_dense")
    lines = ["PSB 1", "30 600", ""]
    for name in sorted(CLASSES, key=lambda name: name[::-1]):
        lines += [f"{name}_test 0 20" if name in ("man", "snake") else f"{name} 0 20"]
        lines += [str(number) for number in numbers_of(CLASSES.index(name))] + [""]
    (root / "categories.txt").write_text("\n".join(lines))
    for number in range(600):
        write_off(root / "raw" / f"T{number}.off", *SHAPE)
    return root


def test_as_shipped(simplified):
    dataset = read_dataset("shrec_16", simplified)
    assert dataset.notes == ()
    assert (dataset.classes, len(dataset.entries)) == (CLASSES, 600)
    assert dataset.split_rule == "as shipped"
    assert Counter(dataset.splits.values()) == {"train": 480, "test": 120}


@pytest.mark.parametrize("kind", ["shrec11", "shrec11_dense"])
@pytest.mark.parametrize("train", [16, 10])
def test_redrawn(request, kind, train):
    root = request.getfixturevalue("simplified" if kind == "shrec11" else "dense")
    name = f"{kind}_split{train}"
    dataset = read_dataset(name, root)
    assert dataset.notes == ()
    assert dataset.name == name  # shards of one are not put where another's are
    assert dataset.split_rule == f"{train} of each class drawn for train by seed 0, the others test"
    counts = Counter((entry.mesh_label, dataset.splits[entry.id]) for entry in dataset.entries)
    assert counts == {
        (label, split): n for label in range(30) for split, n in (("train", train), ("test", 20 - train))
    }
    assert read_dataset(name, root).splits == dataset.splits
    assert read_dataset(name, root, draw=Draw(seed=1)).splits != dataset.splits


def test_both_forms_number_meshes_and_classes_alike(simplified, dense):
    labels = [
        {entry.path.stem: entry.mesh_label for entry in read_dataset(name, root).entries}
        for name, root in (("shrec_16", simplified), ("shrec11_dense_split16", dense))
    ]
    assert labels[0] == labels[1]


def test_599_of_600_are_told_by_name(dense):
    path = dense / "raw" / "T599.off"
    path.rename(dense / "T599.txt")
    try:
        assert read_dataset("shrec11_dense_split10", dense).notes == (
            "missing meshes: T599",
            "shrec11_dense_split10 has 600 meshes, and 599 were found",
        )
    finally:
        (dense / "T599.txt").rename(path)


def test_a_missing_class_is_told_and_the_others_keep_their_numbers(tmp_path):
    for name in ("woman/train/T22", "cat/train/T44", "cat/test/T51"):
        write_obj(tmp_path / f"{name}.obj", *SHAPE)
    dataset = read_dataset("shrec_16", tmp_path)
    assert {entry.id: entry.mesh_label for entry in dataset.entries} == {
        "cat/train/T44": CLASSES.index("cat"),
        "cat/test/T51": CLASSES.index("cat"),
        "woman/train/T22": 29,
    }
    assert dataset.notes[0].startswith("missing classes: alien, ants, ")
    assert dataset.notes[0].endswith(" and 18 more")
    assert dataset.notes[1].startswith("missing meshes: T0, T1, ")


def test_what_is_beside_the_layout_is_told(tmp_path):
    write_obj(tmp_path / "cat" / "train" / "T44.obj", *SHAPE)
    write_obj(tmp_path / "cat" / "T1.obj", *SHAPE)
    write_obj(tmp_path / "cat" / "train" / "more" / "T2.obj", *SHAPE)
    write_obj(tmp_path / "unicorn" / "train" / "T3.obj", *SHAPE)
    assert [note for note in read_dataset("shrec_16", tmp_path).notes if "not part" in note] == [
        "meshes that are not part of the layout, and were not read: 1 in cat",
        "meshes that are not part of the layout, and were not read: 1 in cat/train/more",
        "meshes that are not part of the layout, and were not read: 1 in unicorn/train",
    ]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("PSB 1\n30 600\n\nunicorn 0 20\n1\n", r"categories.txt:4: a class is its name.*'unicorn 0 20'"),
        ("PSB 1\n30 600\n\ncat 0 2\n1\n600\n", r"categories.txt:6: .*0 to 599, not '600'"),
        ("PSB 1\n30 600\n\ncat 0 2\n1 2\n", r"categories.txt:5: .*not '1 2'"),
        ("PSB 1\n30 600\n\ncat 0 2\n1\n", "ends within a class"),
        ("PSB 1\n30 600\n", "ends within a class"),
    ],
)
def test_mistakes_in_the_categories_are_told_with_their_line(tmp_path, text, message):
    write_off(tmp_path / "T1.off", *SHAPE)
    (tmp_path / "categories.txt").write_text(text)
    with pytest.raises(UsageError, match=message):
        read_dataset("shrec11_dense_split16", tmp_path)


def test_categories_that_are_no_text_are_told(tmp_path):
    write_off(tmp_path / "T1.off", *SHAPE)
    (tmp_path / "categories.txt").write_bytes(b"PSB 1\n30 600\n\xff\xfe 0 1\n")
    with pytest.raises(UsageError, match=r"categories.txt:3: a class is its name"):
        read_dataset("shrec11_dense_split16", tmp_path)


def test_meshes_without_categories_are_refused(tmp_path):
    write_off(tmp_path / "T1.off", *SHAPE)
    with pytest.raises(UsageError, match="not in the layout of SHREC11"):
        read_dataset("shrec11_dense_split16", tmp_path)


def test_classes_and_drawn_splits_are_stored(tmp_path):
    for number in range(20):
        write_obj(tmp_path / "raw" / "cat" / "train" / f"T{number}.obj", *box(1, 2, 3 + number))
    dataset = read_dataset("shrec11_split10", tmp_path / "raw", draw=Draw(seed=3))
    report = run(dataset, tmp_path / "out", LIGHT, jobs=1, val_fraction=0.0)
    stored = open_dataset(tmp_path / "out")
    assert {sample.mesh_label for sample in stored} == {CLASSES.index("cat")}
    assert Counter(report.index.splits) == {"train": 10, "test": 10}
    assert report.index.split_rule == "10 of each class drawn for train by seed 3, the others test"
