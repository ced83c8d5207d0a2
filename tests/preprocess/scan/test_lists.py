"""Text files that list meshes, and those that do not."""

from pathlib import Path

import pytest

from meshshard_prep.datasets.layout import Entry
from meshshard_prep.datasets.own.names import Names
from meshshard_prep.scan.lists import find_lists

NAMES = Names([Entry(id=f"off/T{n}", path=Path(f"off/T{n}.off"), source=f"off/T{n}.off") for n in range(10)])
ALL = [f"T{number}" for number in range(10)]


def found(folder, files):
    for name, rows in files.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text("".join(f"{row}\n" for row in rows))
    lists = find_lists(folder, list(files), NAMES)
    return lists.classes, lists.splits


@pytest.mark.parametrize(
    ("files", "classes", "splits"),
    [
        ({"c.txt": [f"{name} {'ab'[n % 2]}" for n, name in enumerate(ALL)]}, "c.txt", {}),
        (
            {"c.csv": ["file,kind", *(f"off/{name}.off,a b" for name in ALL[:5]), *(f"{n},c" for n in ALL[5:])]},
            "c.csv",
            {},
        ),
        ({"c.json": ["{", *(f'"{name}": {n % 2},' for n, name in enumerate(ALL)), '"T99": 1}']}, "c.json", {}),
        ({"c.json": ["[1, 2]"], "test.json": ["{", *(f'"{name}": [1],' for name in ALL), '"T99": [1]}']}, "", {}),
        ({"c.csv": [f"{name},{n}" for n, name in enumerate(ALL)]}, "", {}),  # a number of its own for each
        ({"c.csv": [f"{name},a" for name in ALL]}, "", {}),  # one class is none
        ({"a.txt": ["T1 a", "T2 b"] * 2, "b.txt": ["T1 a", "T2 b"] * 2}, "", {}),  # which of them?
        ({"train.txt": ALL[:6], "test.txt": ALL[6:]}, "", {"train": "train.txt", "test": "test.txt"}),
        ({"lists/my-Valid_2.lst": ALL[:6]}, "", {"val": "lists/my-Valid_2.lst"}),
        ({"train_0.txt": ALL[:5], "train_1.txt": ALL[5:], "test.txt": ALL[:2]}, "", {"test": "test.txt"}),
        ({"test.txt": ["T1", "X1", "X2"]}, "", {}),  # most are no meshes here
        ({"train.log": ALL, "contest.txt": ALL, "meshes.txt": ALL}, "", {}),
        ({"README.txt": ["These meshes are", "from a test of", "T1 and T2"]}, "", {}),
    ],
)
def test_lists(tmp_path, files, classes, splits):
    assert found(tmp_path, files) == (classes, splits)


@pytest.mark.parametrize(
    ("files", "sentence"),
    [
        (
            {"meta.csv": ["object,class,split", *(f"{name},a,train" for name in ALL)]},
            "meta.csv has more columns than two: keep mesh and class",
        ),
        (
            {"train.csv": ["T1,a", "T2,b"] * 2, "test.csv": ["T3,a", "T4,b"] * 2},
            "test.csv, train.csv list classes, and labels.mesh takes one file: make one of them",
        ),
    ],
)
def test_lists_that_are_not_taken_are_told(tmp_path, files, sentence):
    assert found(tmp_path, files) == ("", {})
    assert find_lists(tmp_path, list(files), NAMES).unused == (sentence,)


def test_what_is_no_text_is_no_list(tmp_path):
    (tmp_path / "test.txt").write_bytes(b"T1\nT2\n\xff\xfe")
    assert find_lists(tmp_path, ["test.txt"], NAMES).splits == {}
