"""What a TOML file says of meshes, labels and classes, as far as the labels that are read."""

import re
from pathlib import Path

import numpy as np
import pytest
from shapes import box, write_labels, write_obj

from meshshard.errors import UsageError
from meshshard.palette import class_colour
from meshshard.recipe import RECIPES
from meshshard_prep.datasets import read_dataset
from meshshard_prep.formats import read_mesh
from meshshard_prep.labels import read_labels
from meshshard_prep.run import run

FACES = [5, 5, 5, 9] * 3
"""Labels of a box's 12 faces."""


def meshes(root, *names):
    for name in names:
        write_obj(root / f"{name}.obj", *box())


def toml(tmp_path, text):
    (tmp_path / "my.toml").write_text(text)
    return read_dataset(str(tmp_path / "my.toml"))


def face_classes(dataset):
    """Id -> class index of each face."""
    return {
        entry.id: read_labels(entry.labels, entry.labels.path.read_bytes(), read_mesh(entry.path)).faces.tolist()
        for entry in dataset.entries
    }


def test_a_file_without_keys_is_its_folder(tmp_path):
    meshes(tmp_path, "a", "train/b")
    write_labels(tmp_path / "a.seg", FACES)
    write_labels(tmp_path / "train" / "b.txt", FACES)
    dataset, folder = toml(tmp_path, ""), read_dataset(str(tmp_path))
    assert dataset.name == "my"
    assert (dataset.entries, dataset.classes, dataset.task) == (folder.entries, ("5", "9"), "segmentation")


def test_names_licence_and_citation(tmp_path):
    meshes(tmp_path / "raw", "a")
    dataset = toml(tmp_path, 'name = "b c"\nraw = "raw"\nlicence = "CC0"\ncitation = "me"\n')
    assert (dataset.name, dataset.licence, dataset.citation, dataset.task) == ("b c", "CC0", "me", "unlabelled")


def test_raw_of_the_command_line_comes_first(tmp_path):
    meshes(tmp_path / "there", "a")
    (tmp_path / "my.toml").write_text('raw = "not here"\n')
    assert len(read_dataset(str(tmp_path / "my.toml"), tmp_path / "there").entries) == 1


@pytest.mark.parametrize(
    ("globs", "ids"),
    [
        ('"*.obj"', ["top"]),
        ('"shapes/*"', ["shapes/a", "shapes/b1"]),
        ('"**/*.obj"', ["shapes/a", "shapes/b1", "shapes/deep/c", "top"]),
        ('"shapes/**"', ["shapes/a", "shapes/b1", "shapes/deep/c"]),
        ('["shapes/[!a]?.obj", "t*"]', ["shapes/b1", "top"]),
        ('"**/[a-c].obj"', ["shapes/a", "shapes/deep/c"]),
    ],
)
def test_meshes_are_those_that_are_like_a_pattern(tmp_path, globs, ids):
    meshes(tmp_path, "top", "shapes/a", "shapes/b1", "shapes/deep/c")
    assert sorted(entry.id for entry in toml(tmp_path, f"meshes = {globs}").entries) == ids


@pytest.mark.parametrize(
    ("pattern", "path"),
    [
        ("{folder}/{stem}.lab", "x/shapes/a.lab"),
        ("{folder}/../gt/{stem}.seg", "x/gt/a.seg"),
        ("gt/{below}/{stem}.seg", "gt/shapes/a.seg"),
        ("gt/{stem}_labels.txt", "gt/a_labels.txt"),
        ("../labels/{folder}/{name}.txt", "../labels/x/shapes/a.obj.txt"),
    ],
)
def test_label_files_lie_where_the_pattern_says(tmp_path, pattern, path):
    meshes(tmp_path / "raw", "x/shapes/a", "x/shapes/b")
    write_labels(tmp_path / "raw" / path, FACES)
    dataset = toml(tmp_path, f'raw = "raw"\n[labels]\nfiles = "{pattern}"\n')
    assert face_classes(type(dataset)(**{**vars(dataset), "entries": dataset.entries[:1]})) == {
        "x/shapes/a": [0, 0, 0, 1] * 3
    }
    report = run(dataset, tmp_path / "out", RECIPES["paper"], jobs=1)
    assert report.index.ids == ("x/shapes/a",)
    assert [(entry.id, entry.code) for entry in report.index.refused] == [("x/shapes/b", "no-labels")]


def test_the_form_is_that_of_the_suffix_or_as_said(tmp_path):
    meshes(tmp_path, "a")
    for suffix, form in ((".npy", "npy"), (".json", "json"), (".seg", "lines")):
        Path(tmp_path / f"a{suffix}").write_bytes(b"")
        dataset = toml(tmp_path, f'[labels]\nfiles = "{{stem}}{suffix}"\n[classes]\nx = 1\n')
        assert dataset.entries[0].labels.form == form
        dataset = toml(tmp_path, f'[labels]\nfiles = "{{stem}}{suffix}"\nform = "psb"\n[classes]\nx = 1\n')
        assert dataset.entries[0].labels.form == "psb"


def test_labels_in_the_mesh_file(tmp_path):
    meshes(tmp_path, "a")
    text = (tmp_path / "a.obj").read_text()
    faces = [line for line in text.splitlines() if line.startswith("f")]
    rest = text[: text.index("f ")]
    (tmp_path / "a.obj").write_text(rest + "\n".join(["g leg", *faces[:9], "g seat", *faces[9:], ""]))
    dataset = toml(tmp_path, '[labels]\nform = "obj-group"\n')
    assert dataset.classes == ("leg", "seat")
    assert face_classes(dataset) == {"a": [0] * 9 + [1] * 3}


def test_domain_and_conversion_are_handed_on(tmp_path):
    meshes(tmp_path, "a")
    write_labels(tmp_path / "a.seg", [1] * 8)
    (entry,) = toml(tmp_path, '[labels]\ndomain = "vertex"\nto = "face"\n').entries
    assert (entry.labels.domains, entry.labels.to) == (("vertex",), "face")


def test_classes_are_named_in_the_order_of_labels(tmp_path):
    meshes(tmp_path, "a")
    write_labels(tmp_path / "a.seg", FACES)
    dataset = toml(tmp_path, 'classes = ["leg", "seat"]')
    assert dataset.classes == ("leg", "seat")
    assert face_classes(dataset) == {"a": [0, 0, 0, 1] * 3}


def test_a_table_of_classes_sets_their_order_and_merges_labels(tmp_path):
    meshes(tmp_path, "a")
    write_labels(tmp_path / "a.seg", [5, 9, 7, 0] * 3)
    dataset = toml(tmp_path, '[labels]\nunlabelled = 0\n[classes]\nseat = 9\n"a leg" = [5, 7]\narm = 8\n')
    assert dataset.classes == ("seat", "a leg", "arm")
    assert face_classes(dataset) == {"a": [1, 0, 1, -1] * 3}


def test_unlabelled_values_are_no_classes(tmp_path):
    meshes(tmp_path, "a")
    write_labels(tmp_path / "a.seg", [5, 9, 255, 0] * 3)
    dataset = toml(tmp_path, "[labels]\nunlabelled = [0, 255]\n")
    assert dataset.classes == ("5", "9")
    assert face_classes(dataset) == {"a": [0, 1, -1, -1] * 3}


def test_a_label_that_the_table_lacks_is_refused_with_its_line(tmp_path):
    meshes(tmp_path, "a")
    write_labels(tmp_path / "a.seg", FACES)
    report = run(toml(tmp_path, "[classes]\nleg = 5\n"), tmp_path / "out", RECIPES["paper"], jobs=1)
    assert [entry.code for entry in report.index.refused] == ["bad-label"]
    assert "a.seg:4: a label is one of -1, 5, but this one is '9'" in report.index.refused[0].message


def test_each_folder_may_have_classes_of_its_own(tmp_path):
    for name in ("chairs/x/a", "vases/a", "vases/big/a"):
        meshes(tmp_path, name)
        write_labels(tmp_path / f"{name}.seg", [1, 2, 2] * 4)
    dataset = toml(
        tmp_path,
        "[classes.chairs]\nleg = 1\nhandle = 2\n[classes.vases]\nbody = 1\nhandle = 2\n"
        '[classes."vases/big"]\nlid = [1, 2]\n',
    )
    assert dataset.classes == ("leg", "handle", "body", "lid")
    assert face_classes(dataset) == {
        "chairs/x/a": [0, 1, 1] * 4,
        "vases/a": [2, 1, 1] * 4,
        "vases/big/a": [3, 3, 3] * 4,
    }
    with pytest.raises(UsageError, match=r"my.toml:1: classes is a table for each folder, of vases, and chairs/x/a"):
        toml(tmp_path, "[classes.vases]\nbody = 1\nhandle = 2\n")


def test_colours_of_some_classes_leave_the_others_theirs(tmp_path):
    meshes(tmp_path, "a")
    write_labels(tmp_path / "a.seg", FACES)
    dataset = toml(tmp_path, '[colours]\n9 = "#010203"\n')
    assert dataset.colours == (class_colour(0), "#010203")
    assert toml(tmp_path, "").colours == ()


def test_the_folder_is_the_class_of_a_mesh(tmp_path):
    meshes(tmp_path, "cat/train/1", "test/ant/1", "cat/2")
    dataset = toml(tmp_path, '[labels]\nmesh = "folder"\n')
    assert (dataset.task, dataset.classes) == ("classification", ("ant", "cat"))
    assert {e.id: (e.split, e.mesh_label) for e in dataset.entries} == {
        "cat/train/1": ("train", 1),
        "test/ant/1": ("test", 0),
        "cat/2": ("", 1),
    }
    dataset = toml(tmp_path, '[labels]\nmesh = "folder"\n[classes]\npet = ["cat", "dog"]\ninsect = "ant"\n')
    assert (dataset.classes, [e.mesh_label for e in dataset.entries]) == (("pet", "insect"), [0, 0, 1])
    assert toml(tmp_path, 'classes = ["A", "C"]\n[labels]\nmesh = "folder"\n').classes == ("A", "C")


@pytest.mark.parametrize("separator", [",", ";", "\t", "   "])
def test_a_list_has_the_class_of_each_mesh(tmp_path, separator):
    meshes(tmp_path, "x/T1", "x/T2", "T3", "T4")
    rows = [("mesh", "class"), ("T1", "cat"), ("x/T2.obj", "ant"), ("./T3", "10"), ("T9", "ant")]
    (tmp_path / "list.csv").write_text("".join(f"{name}{separator}{label}\n\n" for name, label in rows))
    dataset = toml(tmp_path, '[labels]\nmesh = "list.csv"\n')
    assert dataset.classes == ("10", "ant", "cat")
    assert {e.id: e.mesh_label for e in dataset.entries} == {"x/T1": 2, "x/T2": 1, "T3": 0}
    assert dataset.notes == (
        f"list.csv: 2 rows name no mesh, the first is list.csv:1: {f'mesh{separator}class'!r}",
        "list.csv has no class for 1 meshes, which are left out; the first is T4.obj",
    )


def test_a_json_object_has_the_class_of_each_mesh(tmp_path):
    meshes(tmp_path, "x/T1", "x/T2", "T3", "T4")
    (tmp_path / "list.json").write_text('{"T1": "night, stand", "x/T2.obj": 10, "T3": "ant", "T9": "ant"}')
    dataset = toml(tmp_path, '[labels]\nmesh = "list.json"\n')
    assert dataset.classes == ("10", "ant", "night, stand")
    assert {e.id: e.mesh_label for e in dataset.entries} == {"x/T1": 2, "x/T2": 0, "T3": 1}
    assert dataset.notes == (
        "list.json: 1 rows name no mesh, the first is list.json, key 'T9': 'T9'",
        "list.json has no class for 1 meshes, which are left out; the first is T4.obj",
    )


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[1]", "an object that has a text or an integer, the class, for each mesh, and no list"),
        ('{"T1": "a", "T2": [1]}', r"for each mesh; 'T2' has \[1\]"),
        ('{"T1": true}', "for each mesh; 'T1' has true"),
        ('{"T1": ', "cannot be read: Expecting value"),
    ],
)
def test_json_that_is_no_such_object(tmp_path, text, message):
    meshes(tmp_path, "T1", "T2")
    (tmp_path / "list.json").write_text(text)
    with pytest.raises(UsageError, match=rf"my.toml:2: the list .*list.json .*{message}"):
        toml(tmp_path, '[labels]\nmesh = "list.json"\n')


@pytest.mark.parametrize("layout", ["meshcnn-segmentation", "meshcnn-classification"])
def test_meshcnn_layouts(tmp_path, layout):
    meshes(tmp_path, "train/1", "test/2", "cat/train/3", "cat/test/4")
    for name in ("1", "2"):
        write_labels(tmp_path / "seg" / f"{name}.eseg", np.arange(12) % 2)
    dataset = toml(tmp_path, f'layout = "{layout}"\n')
    if layout == "meshcnn-segmentation":
        assert face_classes(dataset) == {"train/1": [0, 1] * 6, "test/2": [0, 1] * 6}
        dataset = toml(
            tmp_path, f'classes = ["a", "b"]\nlayout = "{layout}"\n[labels]\ndomain = "face"\nto = "vertex"\n'
        )
        assert (dataset.classes, dataset.entries[0].labels.domains) == (("a", "b"), ("face",))
        assert dataset.entries[0].labels.to == "vertex"
    else:
        assert {e.id: e.mesh_label for e in dataset.entries} == {"cat/train/3": 0, "cat/test/4": 0}


@pytest.mark.parametrize(
    ("which", "meshes", "classes", "note"),
    [
        (
            "folder",
            ("cat/1/m", "cat/2/m", "dog/3/m"),
            3,
            r'toml:2: "folder" gives each mesh its own class; is "top',
        ),
        ("folder", ("cat/1/models/m", "dog/3/models/m"), 1, r"\"folder\" gives all meshes one class, 'models'; is"),
        ("top folder", ("cat/1/m", "cat/2/m", "dog/3/m"), 2, ""),
        ("top folder", ("train/cat/1/m", "test/cat/2/m", "test/dog/3/m"), 2, ""),
    ],
)
def test_folders_of_classes_and_a_note_where_that_cannot_be(tmp_path, which, meshes, classes, note):
    for mesh in meshes:
        write_obj(tmp_path / f"{mesh}.obj", *box())
    dataset = toml(tmp_path, f'[labels]\nmesh = "{which}"\n')
    assert len(dataset.classes) == classes
    assert len(dataset.notes) == bool(note)
    assert re.search(note, "".join(dataset.notes))


def test_integer_classes_of_a_list_are_in_order_and_names_of_several_meshes_are_refused(tmp_path):
    for number in range(12):
        write_obj(tmp_path / "x" / f"m{number}.obj", *box())
    (tmp_path / "classes.csv").write_text("".join(f"m{number},{number}\n" for number in range(12)))
    dataset = toml(tmp_path, '[labels]\nmesh = "classes.csv"\n')
    assert dataset.classes == tuple(map(str, range(12)))
    assert {entry.id: entry.mesh_label for entry in dataset.entries} == {f"x/m{n}": n for n in range(12)}
    write_obj(tmp_path / "y" / "m3.obj", *box())
    with pytest.raises(UsageError, match=r"classes.csv:4: 'm3' names 2 meshes, x/m3, y/m3; write more of the path"):
        toml(tmp_path, '[labels]\nmesh = "classes.csv"\n')


def test_names_of_classes_that_no_shard_can_hold_are_refused_before_anything_is_computed(tmp_path):
    write_obj(tmp_path / "a.obj", *box())
    write_labels(tmp_path / "a.seg", FACES)
    names = {"a" * 40_000: 5, "b" * 40_000: 9}
    text = "[classes]\n" + "".join(f"{name} = {label}\n" for name, label in names.items())
    with pytest.raises(UsageError, match=r"has 2 classes, which take 80008 bytes; a data set has at most"):
        run(toml(tmp_path, text), tmp_path / "out", RECIPES["paper"], jobs=1)
    assert not (tmp_path / "out" / "index.json").exists()
