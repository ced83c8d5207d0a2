"""Where the data has two readings, one line of the TOML file says so; both readings run."""

import pytest
from scanned import scanned
from shapes import bumpy, grid, write_labels, write_obj

from meshshard_prep.datasets import read_dataset
from meshshard_prep.scan.write import EDIT


def edit(toml, found, change):
    """The one line that asks to be looked at, and the data set after an edit of the text."""
    ((line, what),) = found["edits"]
    text = toml.read_text()
    assert text.splitlines()[line - 1] == EDIT + what
    assert text.count("EDIT") == 1
    assert change(text) != text
    toml.write_text(change(text))
    return what, read_dataset(str(toml))


def test_sets_side_by_side_have_classes_of_their_own(tmp_path, capsys):
    for name, values in (("chairs", (1, 2)), ("tele-aliens", (1, 2, 3, 4))):
        for number in (1, 2):
            write_obj(tmp_path / "raw" / name / "shapes" / f"{number}.obj", *bumpy(number, 1))
            write_labels(tmp_path / "raw" / name / "gt" / f"{number}.seg", [*values] * (32 // len(values)))
    toml, found = scanned(tmp_path / "raw", tmp_path, capsys)
    assert found["sets"] == ["chairs", "tele-aliens"]
    dataset = read_dataset(str(toml))
    assert dataset.classes == ("chairs 1", "chairs 2", *(f"tele-aliens {number}" for number in (1, 2, 3, 4)))
    tables = {entry.id.split("/")[0]: dict(entry.labels.classes) for entry in dataset.entries}
    assert tables == {"chairs": {1: 0, 2: 1}, "tele-aliens": {1: 2, 2: 3, 3: 4, 4: 5}}
    same = lambda text: text.replace('"chairs ', '"part ').replace('"tele-aliens ', '"part ')  # noqa: E731
    what, dataset = edit(toml, found, same)
    assert what.startswith("do labels of chairs and tele-aliens mean the same?")
    assert dataset.classes == ("part 1", "part 2", "part 3", "part 4")


@pytest.mark.parametrize("folders", [("train/shapes", "test/shapes"), ("a", "b"), ("a/shapes/big", "shapes")])
def test_what_is_no_set_of_its_own(tmp_path, folders, capsys):
    for number, folder in enumerate(folders):
        write_obj(tmp_path / "raw" / folder / f"{number}.obj", *bumpy(number, 1))
        write_labels(tmp_path / "raw" / folder / f"{number}.seg", [1, 2] * 16)
    assert scanned(tmp_path / "raw", tmp_path, capsys)[1]["sets"] == []


def test_folders_that_may_be_classes(tmp_path, capsys):
    for name in ("monday/a", "monday/b", "friday/c", "friday/d"):
        write_obj(tmp_path / "raw" / f"{name}.obj", *bumpy(0, 1))
    toml, found = scanned(tmp_path / "raw", tmp_path, capsys)
    assert read_dataset(str(toml)).classes == ("friday", "monday")
    what, dataset = edit(toml, found, lambda text: text[: text.index("[labels]")])
    assert what.startswith("are these folders classes?")
    assert dataset.task == "unlabelled"


@pytest.mark.parametrize("names", [("x/a", "y/b"), ("a", "b"), ("x/a", "b", "y/c", "y/d")])
def test_folders_that_are_no_classes(tmp_path, names, capsys):
    for name in names:
        write_obj(tmp_path / "raw" / f"{name}.obj", *bumpy(0, 1))
    assert scanned(tmp_path / "raw", tmp_path, capsys)[1]["class_folders"] == {}


def test_counts_that_fit_twice(tmp_path, capsys):
    for name in "ab":
        write_obj(tmp_path / "raw" / f"{name}.obj", *grid(3, 2))  # 12 faces, 12 vertices
        write_labels(tmp_path / "raw" / f"{name}.seg", [1, 2] * 6)
    toml, found = scanned(tmp_path / "raw", tmp_path, capsys)
    assert found["labels"][0]["fits"] == {"face": 2, "edge": 0, "vertex": 2}
    assert read_dataset(str(toml)).entries[0].labels.domains == ("face",)
    other = lambda text: text.replace('domain = "face"', "").replace("# domain", "domain")  # noqa: E731
    what, dataset = edit(toml, found, other)
    assert what.startswith("counts fit face and vertex alike")
    assert dataset.entries[0].labels.domains == ("vertex",)


def test_two_kinds_of_label_files(tmp_path, capsys):
    for name in "ab":
        write_obj(tmp_path / "raw" / f"{name}.obj", *bumpy(0, 1))
        write_labels(tmp_path / "raw" / f"{name}_coarse.txt", [1, 2] * 16)
        write_labels(tmp_path / "raw" / f"{name}_fine.txt", [1, 2, 3, 4] * 8)
    toml, found = scanned(tmp_path / "raw", tmp_path, capsys)
    assert [one["files"] for one in found["labels"]] == ["{stem}_fine.txt", "{stem}_coarse.txt"]
    assert read_dataset(str(toml)).classes == ("1", "2", "3", "4")
    fine, coarse = '\nfiles = "{stem}_fine.txt"', '\n# files = "{stem}_coarse.txt"'
    what, dataset = edit(toml, found, lambda text: text.replace(fine, "").replace(coarse, coarse.replace("# ", "")))
    assert what.startswith("several files or properties fit")
    assert dataset.classes == ("1", "2")


def test_meshes_of_a_folder_may_belong_together(tmp_path, capsys):
    for patient in range(6):
        for jaw in ("lower", "upper"):
            write_obj(tmp_path / "raw" / f"p{patient}" / f"{jaw}.obj", *bumpy(patient, 1))
            write_labels(tmp_path / "raw" / f"p{patient}" / f"{jaw}.seg", [1, 2] * 16)
    toml, found = scanned(tmp_path / "raw", tmp_path, capsys)
    what, dataset = edit(toml, found, lambda text: text.replace("# group", "group"))
    assert what.startswith("do the meshes of a folder belong together")
    splits = {(entry.group, dataset.splits[entry.id]) for entry in dataset.entries}
    assert len(splits) == 6
    assert {split for _, split in splits} == {"train", "val", "test"}


def test_classes_above_a_folder_for_each_mesh(tmp_path, capsys):
    for name in ("chair/1a", "chair/2b", "lamp/3c", "lamp/4d"):
        write_obj(tmp_path / "raw" / name / "models" / "model.obj", *bumpy(0, 1))
    toml, found = scanned(tmp_path / "raw", tmp_path, capsys)
    dataset = read_dataset(str(toml))
    assert (dataset.classes, dataset.notes) == (("chair", "lamp"), ())
    assert found["class_folders"] == {"chair": 2, "lamp": 2}
    what, _ = edit(toml, found, lambda text: text[: text.index("[labels]")])
    assert what.startswith("are these folders classes?")


def test_the_nearest_folders_may_be_classes_or_the_outermost(tmp_path, capsys):
    for name in ("Bed", "Chair", "Lamp", "Sofa", "Table"):
        for inner in ("2019", "2020/b"):
            write_obj(tmp_path / "raw" / name / inner / f"{name}.OBJ", *bumpy(0, 1))
    toml, found = scanned(tmp_path / "raw", tmp_path, capsys)
    assert (
        'mesh = "folder"  # 2019, b\n# mesh = "top folder"  # Bed, Chair, Lamp, Sofa and 1 more\n' in toml.read_text()
    )
    assert read_dataset(str(toml)).classes == ("2019", "b")
    outermost = lambda text: text.replace('mesh = "folder"', "").replace("# mesh", "mesh")  # noqa: E731
    what, dataset = edit(toml, found, outermost)
    assert what == "are these folders classes, or the outermost ones, or none? Keep the line that is meant."
    assert dataset.classes == ("Bed", "Chair", "Lamp", "Sofa", "Table")


def test_labels_of_vertices_come_with_the_line_that_makes_them_those_of_faces(tmp_path, capsys):
    write_obj(tmp_path / "raw" / "a.obj", *bumpy(0, 1))
    write_labels(tmp_path / "raw" / "a.txt", [1, 2] * 9)
    toml, _ = scanned(tmp_path / "raw", tmp_path, capsys)
    assert read_dataset(str(toml)).entries[0].labels.to == ""
    toml.write_text(toml.read_text().replace("# to =", "to ="))
    assert read_dataset(str(toml)).entries[0].labels.to == "face"


def test_a_label_that_often_means_none_comes_with_the_line_that_says_so(tmp_path, capsys):
    for name in "ab":
        write_obj(tmp_path / "raw" / f"{name}.obj", *bumpy(0, 1))
        write_labels(tmp_path / "raw" / f"{name}.seg", [0, 1, 2, 255] * 8)
    toml, found = scanned(tmp_path / "raw", tmp_path, capsys)
    text = toml.read_text()
    assert text.count("# unlabelled = 255") == 1
    assert read_dataset(str(toml)).classes == ("0", "1", "2", "255")
    toml.write_text(text.replace("# unlabelled", "unlabelled").replace('"255" = 255', ""))
    dataset = read_dataset(str(toml))
    assert dataset.classes == ("0", "1", "2")
    assert dataset.entries[0].labels.classes[255] == -1
    assert found["edits"] == []


def test_meshes_that_share_a_label_file_are_told(tmp_path, capsys):
    for split in ("train", "test"):
        write_obj(tmp_path / "raw" / split / "m0.obj", *bumpy(len(split), 1))
    write_labels(tmp_path / "raw" / "seg" / "m0.seg", [1, 2] * 16)
    _, found = scanned(tmp_path / "raw", tmp_path, capsys)
    assert found["labels"][0]["sharing"] == ["train/m0.obj"]
