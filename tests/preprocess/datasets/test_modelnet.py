"""ModelNet and Manifold40: forty folders, counts that are or are not the published ones, headers that are broken."""

import pytest
from light import LIGHT
from shapes import box, write_obj, write_off

from meshshard import open_dataset
from meshshard_prep.datasets import ADAPTERS, read_dataset
from meshshard_prep.run import run


@pytest.mark.parametrize(("name", "classes"), [("modelnet10", 10), ("modelnet40", 40), ("manifold40", 40)])
def test_all_classes_with_few_meshes(tmp_path, name, classes):
    known = ADAPTERS[name].read.keywords["classes"]
    assert len(known) == classes == len(set(known)) == ADAPTERS[name].expected["classes"]
    assert list(known) == sorted(known)
    for label in known:
        for split in ("train", "test"):
            write = write_obj if name == "manifold40" else write_off
            write(tmp_path / label / split / f"{label}_0001.{'obj' if name == 'manifold40' else 'off'}", *box())
    dataset = read_dataset(name, tmp_path)
    assert [entry.mesh_label for entry in dataset.entries] == [n for n in range(classes) for _ in range(2)]
    train, test = ADAPTERS[name].expected["train"], ADAPTERS[name].expected["test"]
    assert dataset.notes == (
        f"{name} has {train} train meshes, and {classes} were found",
        f"{name} has {test} test meshes, and {classes} were found",
    )


def test_the_published_counts():
    assert ADAPTERS["manifold40"].expected["train"] + ADAPTERS["manifold40"].expected["test"] == 12_311
    assert ADAPTERS["modelnet10"].expected["train"] + ADAPTERS["modelnet10"].expected["test"] == 4_899


def test_headers_without_a_line_end_are_read(tmp_path):
    write_off(tmp_path / "raw" / "chair" / "train" / "chair_0001.off", *box(), keyword="OFF")
    assert (tmp_path / "raw" / "chair" / "train" / "chair_0001.off").read_text().startswith("OFF8 12 0\n")
    assert run(read_dataset("modelnet10", tmp_path / "raw"), tmp_path / "out", LIGHT, jobs=1).ok
    (sample,) = open_dataset(tmp_path / "out")
    assert (len(sample.vertices), len(sample.faces), sample.mesh_label) == (8, 12, 2)


def test_cubes_take_their_classes_from_the_folders(tmp_path):
    for number in range(22):
        for split in ("train", "test"):
            write_obj(tmp_path / f"icon{number:02}" / split / "cube.obj", *box())
    dataset = read_dataset("cubes", tmp_path)
    assert len(dataset.classes) == 22
    assert [note for note in dataset.notes if "classes" in note] == []
    (tmp_path / "icon00" / "train" / "cube.obj").unlink()
    (tmp_path / "icon00" / "test" / "cube.obj").unlink()
    (tmp_path / "icon00" / "train").rmdir()
    (tmp_path / "icon00" / "test").rmdir()
    assert "cubes has 22 classes, and 21 were found" in read_dataset("cubes", tmp_path).notes
