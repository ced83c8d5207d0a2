"""Which files belong to which mesh, by name alone."""

import pytest

from meshshard_prep.scan.names import patterns_of


@pytest.mark.parametrize(
    ("files", "pattern"),
    [
        ({"a.obj": "a.seg", "b.obj": "b.seg"}, "{stem}.seg"),
        ({"x/a.obj": "x/a.seg", "y/b.obj": "y/b.seg"}, "{folder}/{stem}.seg"),
        ({"x/1.off": "gt/1.seg", "y/2.off": "gt/2.seg"}, "gt/{stem}.seg"),
        ({"c/x/1.off": "c/gt/1.seg", "d/x/1.off": "d/gt/1.seg"}, "{folder}/../gt/{stem}.seg"),
        ({"m/train/a.obj": "l/train/a.txt", "m/test/x/a.obj": "l/test/x/a.txt"}, "l/{below}/{stem}.txt"),
        ({"a.obj": "a.obj.txt", "b.off": "b.off.txt"}, "{name}.txt"),
        ({"1.off": "1_labels.txt", "10.off": "10_labels.txt"}, "{stem}_labels.txt"),
        ({"1.off": "seg/part_of-1.txt", "1-2.off": "seg/part_of-1-2.txt"}, "seg/part_of-{stem}.txt"),
        ({"a.b.obj": "a.b.faces.npy", "c.obj": "c.faces.npy"}, "{stem}.faces.npy"),
        ({"a b.obj": "a b.seg", "a.obj": "a.seg"}, "{stem}.seg"),
        ({"x/mesh.obj": "x/faces.txt", "y/mesh.obj": "y/faces.txt"}, "{folder}/faces.txt"),
        ({"x/mesh.obj": "x/mesh.txt", "y/mesh.obj": "y/mesh.txt"}, "{folder}/{stem}.txt"),
    ],
)
def test_the_pattern_that_leads_from_meshes_to_files(files, pattern):
    found, *rest = patterns_of(sorted(files), sorted(files.values()))
    assert (found.text, found.files, rest) == (pattern, files, [])


def test_files_of_several_kinds_are_several_patterns():
    meshes = ["train/a.obj", "test/b.obj"]
    others = ["seg/a.eseg", "seg/b.eseg", "sseg/a.seseg", "sseg/b.seseg", "train/a.mtl", "README.txt", "test/c.mtl"]
    found = {pattern.text: sorted(pattern.files) for pattern in patterns_of(meshes, others)}
    assert found == {
        "seg/{stem}.eseg": sorted(meshes),
        "sseg/{stem}.seseg": sorted(meshes),
        "{folder}/{stem}.mtl": ["train/a.obj"],
    }


def test_a_pattern_leaves_out_the_meshes_whose_file_is_missing():
    (found,) = patterns_of(["a.obj", "b.obj", "c.obj"], ["a.seg", "c.seg"])
    assert found.files == {"a.obj": "a.seg", "c.obj": "c.seg"}


@pytest.mark.parametrize(
    "others", [[], ["notes.txt", "x/.seg", "ab.seg"], ["{a}.seg", "a{.seg"], ["x/1.txt", "y/2.txt"]]
)
def test_files_of_no_mesh(others):
    assert patterns_of(["a.obj", "b.obj", "x/m.obj", "y/m.obj"], others) == []
