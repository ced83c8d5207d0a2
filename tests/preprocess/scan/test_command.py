"""What `scan` tells, writes, and refuses to write over."""

import json
import os
import tomllib

import numpy as np
import pytest
from scanned import scanned
from shapes import bumpy, write_labels, write_obj

from meshshard.errors import UsageError
from meshshard.remote import to_path
from meshshard_prep.datasets import read_dataset
from meshshard_prep.scan.command import scan


@pytest.fixture
def raw(tmp_path):
    for name in ("a", "b", "c"):
        write_obj(tmp_path / "raw" / f"{name}.obj", *bumpy(0, 1))
        write_labels(tmp_path / "raw" / f"{name}.seg", [1, 2] * 16)
    return tmp_path / "raw"


def call(folder, **options):
    scan(folder, **({"out": None, "name": "", "force": False, "as_json": False} | options))


def test_it_says_what_it_found_and_what_to_type_next(raw, monkeypatch, capsys):
    monkeypatch.chdir(raw.parent)
    write_labels(raw / "b.seg", [1, 2] * 15)
    write_labels(raw / "z.seg", [1] * 32)
    (raw / "c.seg").unlink()
    (raw / "broken.obj").write_text("<html>")
    (raw / "model.stl").write_text("solid")
    (raw / ".hidden.obj").write_text("")
    call(raw)
    lines = capsys.readouterr().out.splitlines()
    assert [line.rstrip() for line in lines] == [
        "meshes       4: 3 OBJ",
        "             18 vertices, 32 faces",
        "no meshes    1 files with a mesh's ending, as broken.obj: the file is a mesh, but it is a web page or other "
        "XML. Download the file itself, not the page that shows it. [not-a-mesh]",
        "labels       {stem}.seg (lines): of 4 meshes, 1 fit faces, 0 fit edges, 0 fit vertices",
        "             2 labels: 1 in 1, 2 in 1",
        "             1 meshes have no such file: c.obj",
        "             1 do not fit: b.obj: 30 labels, 32 faces and 18 vertices",
        "no mesh      1 files look like labels of no mesh: z.seg",
        "other files  1 .stl",
        "wrote        raw.toml",
        "next         meshshard features raw.toml",
    ]
    assert "# 2 meshes have no labels that fit: features will refuse them\n" in (raw.parent / "raw.toml").read_text()


def test_no_labels_are_told_and_where_they_could_be(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "raw").mkdir()
    lines = ["ply", "format ascii 1.0", "element vertex 3", *(f"property float {axis}" for axis in "xyz")]
    lines += ["element face 1", "property list uchar int vertex_indices", "property uchar red", "end_header"]
    (tmp_path / "raw" / "a.ply").write_text("\n".join([*lines, "0 0 0", "1 0 0", "0 1 0", "3 0 1 2 255", ""]))
    call(tmp_path / "raw")
    assert [line.rstrip() for line in capsys.readouterr().out.splitlines()] == [
        "meshes       1: 1 PLY",
        "             3 vertices, 1 faces",
        "labels       none found, and training needs them; the file has lines to fill in",
        "             not taken as labels: face red; give labels an integer property of their own",
        "wrote        raw.toml",
        "next         meshshard features raw.toml",
    ]
    text = (tmp_path / "raw.toml").read_text()
    text = text.replace("# [labels]", "[labels]").replace("# mesh = ", "mesh = ")
    (tmp_path / "raw.toml").write_text(text)
    (tmp_path / "raw" / "classes.csv").write_text("a,chair\n")
    assert read_dataset("raw.toml").classes == ("chair",)


def test_a_file_that_is_there_stays_as_it_is(raw, tmp_path, capsys):
    (tmp_path / "my.toml").write_text("mine")
    with pytest.raises(UsageError, match=r"my.toml is there; give another name with --out, or .* --force"):
        call(raw, out=tmp_path / "my.toml")
    assert (tmp_path / "my.toml").read_text() == "mine"
    scanned(raw, tmp_path, capsys, out=tmp_path / "my.toml", force=True)
    assert tomllib.loads((tmp_path / "my.toml").read_text())["raw"] == "raw"


def test_raw_is_relative_to_the_file_and_the_name_is_one(raw, tmp_path, capsys):
    (tmp_path / "x" / "y").mkdir(parents=True)
    raw.rename(tmp_path / "(my) data=1")
    (tmp_path / "elsewhere").symlink_to(tmp_path / "x" / "y")
    out = tmp_path / "elsewhere" / "my.toml"
    scanned(tmp_path / "(my) data=1", tmp_path, capsys, out=out)
    assert tomllib.loads(out.read_text())["raw"] == "../../(my) data=1"
    assert read_dataset(str(out)).name == "_my_ data_1"


@pytest.mark.parametrize(
    ("files", "message"),
    [
        ([], "holds no mesh: no file ends in .obj, .off, .ply"),
        (["a.stl", "b.STL", "c.txt"], "holds no mesh: .*; 2 files are meshes of other formats: convert"),
        (None, "is no folder; scan looks at a folder of meshes"),
    ],
)
def test_without_a_mesh_there_is_nothing_to_write(tmp_path, files, message):
    folder = tmp_path / "raw"
    if files is not None:
        folder.mkdir()
        for name in files:
            (folder / name).write_text("")
    with pytest.raises(UsageError, match=message):
        call(folder, out=tmp_path / "my.toml")
    assert not (tmp_path / "my.toml").exists()


def test_a_folder_behind_a_url(raw, tmp_path, capsys):
    from fsspec import filesystem

    memory = filesystem("memory")
    for path in raw.iterdir():
        memory.pipe_file(f"/scan-test/{path.name}", path.read_bytes())
    try:
        toml, found = scanned(to_path("memory://scan-test"), tmp_path, capsys)
        assert tomllib.loads(toml.read_text())["raw"] == "memory://scan-test"
        dataset = read_dataset(str(toml))
    finally:
        memory.rm("/scan-test", recursive=True)
    assert (found["meshes"], dataset.classes, len(dataset.entries)) == (3, ("1", "2"), 3)


def test_names_that_are_no_utf8_and_files_that_are_odd(tmp_path, capsys):
    raw = tmp_path / "raw"
    for folder in ("a\udcff", 'quote"d'):
        for number in range(2):
            write_obj(raw / folder / f"{number}.obj", *bumpy(0, 1))
    np.save(raw / "0.npy", np.zeros(3))
    (raw / "loop.seg").symlink_to(raw / "loop.seg")
    os.mkfifo(raw / "pipe.txt")
    os.mkfifo(raw / "pipe.obj")
    toml, found = scanned(raw, tmp_path, capsys)
    assert found["meshes"] == 5
    assert tomllib.loads(toml.read_text())["name"] == "raw"
    assert "it is no regular file" in json.dumps(found["no_meshes"])


def test_numbers_that_are_no_labels(tmp_path, capsys):
    mesh = bumpy(0, 3)
    for name in "ab":
        write_obj(tmp_path / "raw" / f"{name}.obj", *mesh)
        write_labels(tmp_path / "raw" / f"{name}.vts", np.random.default_rng(0).permutation(len(mesh[0])))
        write_labels(tmp_path / "raw" / f"{name}.area", np.random.default_rng(0).random(len(mesh[1])))
        (tmp_path / "raw" / f"{name}.mtl").write_text("".join(f"Kd {number}\n" for number in range(len(mesh[1]))))
        (tmp_path / "raw" / f"{name}.json").write_text('{"made": "by hand"}')
    found = scanned(tmp_path / "raw", tmp_path, capsys)[1]
    assert (found["labels"], found["reading"]) == ([], "none")
    assert found["other_files"] == {".vts": 2, ".area": 2, ".mtl": 2, ".json": 2}
