"""Folders as people have them: scanned, run from the TOML file as it was written, and the stored labels compared."""

import json

import numpy as np
import pytest
from scanned import scanned
from shapes import bumpy, grid, write_labels, write_obj

from meshshard.dataset import open_dataset
from meshshard.recipe import RECIPES
from meshshard_prep.datasets import read_dataset
from meshshard_prep.datasets.own.labels import filled_in
from meshshard_prep.run import run

MESHES = {name: bumpy(number, level=1) for number, name in enumerate(("1", "2", "10", "b_3", "chair.4"))}
"""32 faces, 48 edges, 18 vertices each."""


def drawn(name, count, values=(1, 2, 5)):
    """Labels of a mesh, every one of the values among them."""
    labels = np.random.default_rng(len(name)).choice(values, size=count)
    labels[: len(values)] = values
    return labels.tolist()


def write_off(path, vertices, faces):
    path.parent.mkdir(parents=True, exist_ok=True)
    rows = [f"{x!r} {y!r} {z!r}\n" for x, y, z in vertices.tolist()]
    rows += [f"3 {a} {b} {c}\n" for a, b, c in faces.tolist()]
    path.write_text(f"OFF\n{len(vertices)} {len(faces)} 0\n" + "".join(rows))


def write_ply(path, vertices, faces, labels):
    head = [
        *("ply", "format ascii 1.0", f"element vertex {len(vertices)}"),
        *(f"property double {axis}" for axis in "xyz"),
        *(f"element face {len(faces)}", "property list uchar int vertex_indices"),
        *("property uchar red", "property int part", "end_header"),
    ]
    rows = [" ".join(map(repr, row)) for row in vertices.tolist()]
    path.parent.mkdir(parents=True, exist_ok=True)
    rows += [f"3 {a} {b} {c} {label % 7} {label}" for (a, b, c), label in zip(faces.tolist(), labels, strict=True)]
    path.write_text("\n".join([*head, *rows, ""]))


def write_groups(path, vertices, faces, labels, keyword):
    write_obj(path, vertices, faces)
    text = path.read_text()
    lines = [line for line in text.splitlines() if line.startswith("f ")]
    body = "".join(f"{keyword} part{label}\n{line}\n" for line, label in zip(lines, labels, strict=True))
    path.write_text(text[: text.index("f ")] + body)


def beside(root, name, mesh, labels):
    write_obj(root / f"{name}.obj", *mesh)
    write_labels(root / f"{name}.seg", labels)


def parallel(root, name, mesh, labels):
    write_off(root / "shapes" / f"{name}.off", *mesh)
    write_labels(root / "gt" / f"{name}.seg", labels)


def affixed_arrays(root, name, mesh, labels):
    write_off(root / "data" / "off" / f"{name}.off", *mesh)
    path = root / "data" / "ann" / f"{name}_labels.npy"
    path.parent.mkdir(parents=True, exist_ok=True)
    np.save(path, np.array(labels, dtype=np.uint8))


def json_of_file_name(root, name, mesh, labels):
    write_obj(root / f"{name}.obj", *mesh)
    (root / f"{name}.obj.json").write_text(json.dumps([f"part{label}" for label in labels]))


def in_ply(root, name, mesh, labels):
    write_ply(root / f"{name}.ply", *mesh, labels)


def in_groups(root, name, mesh, labels):
    write_groups(root / f"{name}.obj", *mesh, labels, "g")


def in_materials(root, name, mesh, labels):
    write_groups(root / f"{name}.obj", *mesh, labels, "usemtl")


def princeton(root, name, mesh, labels):
    write_off(root / "Chair" / f"{name}.off", *mesh)
    parts = {value: [i + 1 for i, label in enumerate(labels) if label == value] for value in sorted(set(labels))}
    text = "".join(f"part{value}\n{' '.join(map(str, numbers))}\n" for value, numbers in parts.items())
    (root / "Chair" / f"{name}_labels.txt").write_text(text)


def one_json(root, name, mesh, labels, key="{stem}"):
    source = f"shapes/{name}.off"
    write_off(root / source, *mesh)
    file = root / "labels.json"
    others = json.loads(file.read_text()) if file.is_file() else {"version": 1}
    file.write_text(json.dumps(others | {filled_in(key, source): labels}))


def one_json_of_paths(root, name, mesh, labels):
    one_json(root, name, mesh, labels, "{folder}/{name}")


LAYOUTS = [
    *(beside, parallel, affixed_arrays, json_of_file_name, one_json, one_json_of_paths),
    *(in_ply, in_groups, in_materials, princeton),
]


def stored(toml, out):
    """Id -> the sample of each mesh that `features` stores."""
    report = run(read_dataset(str(toml)), out, RECIPES["paper"], jobs=1)
    assert report.ok, report.index.refused
    return {sample.id: sample for sample in open_dataset(out)}, report.index


@pytest.mark.parametrize("layout", LAYOUTS)
def test_labels_of_faces_are_stored_as_written(tmp_path, layout, capsys):
    labels = {name: drawn(name, len(faces)) for name, (_, faces) in MESHES.items()}
    for name, mesh in MESHES.items():
        layout(tmp_path / "raw", name, mesh, labels[name])
    (tmp_path / "raw" / "README.txt").write_text("Labels are of faces.\n")
    toml, found = scanned(tmp_path / "raw", tmp_path, capsys)
    assert found["edits"] == []
    assert found["labels"][0]["fits"] == {"face": 5, "edge": 0, "vertex": 0}
    assert found["other_files"] == {".txt": 1}
    samples, index = stored(toml, tmp_path / "out")
    names = index.classes
    assert [name.removeprefix("part") for name in names] == ["1", "2", "5"]
    for name, sample in samples.items():
        expected = labels[name.rsplit("/", 1)[-1]]
        assert [int(names[number].removeprefix("part")) for number in sample.face_labels] == expected
        assert sample.label_domain == "face"
    assert sorted(set(index.splits)) == ["test", "train", "val"]


@pytest.mark.parametrize("domain", ["edge", "vertex"])
def test_labels_of_edges_and_vertices(tmp_path, domain, capsys):
    count = {"edge": 48, "vertex": 18}[domain]
    for number, (name, mesh) in enumerate(MESHES.items()):
        write_obj(tmp_path / "raw" / ("train", "test")[number % 2] / f"{name}.obj", *mesh)
        write_labels(tmp_path / "raw" / "seg" / f"{name}.eseg", drawn(name, count))
    toml, found = scanned(tmp_path / "raw", tmp_path, capsys)
    (labelling,) = found["labels"]
    assert labelling["files"] == "seg/{stem}.eseg"
    assert labelling["fits"] == dict.fromkeys(("face", "edge", "vertex"), 0) | {domain: 5}
    assert (found["edits"], found["splits"]) == ([], {"test": 2, "train": 3})
    samples, index = stored(toml, tmp_path / "out")
    assert set(index.classes) == {"1", "2", "5"}
    for name, sample in samples.items():
        assert sample.label_domain == domain
        if domain == "vertex":
            expected = drawn(name.split("/")[1], count)
            assert [int(index.classes[number]) for number in sample.vertex_labels] == expected


@pytest.mark.parametrize("place", ["{kind}/{split}/{name}", "{split}/{kind}/{name}"])
def test_folders_are_classes_and_splits(tmp_path, place, capsys):
    for number, (name, mesh) in enumerate(MESHES.items()):
        for kind in ("cat", "ant", "bee"):
            split = ("train", "test")[number % 2]
            write_obj(tmp_path / "raw" / f"{place.format(kind=kind, split=split, name=name)}.obj", *mesh)
    toml, found = scanned(tmp_path / "raw", tmp_path, capsys)
    assert (found["edits"], found["class_folders"]) == ([], {"ant": 5, "bee": 5, "cat": 5})
    dataset = read_dataset(str(toml))
    assert (dataset.task, dataset.classes) == ("classification", ("ant", "bee", "cat"))
    for entry in dataset.entries:
        assert dataset.classes[entry.mesh_label] in entry.source.split("/")
        assert entry.split in entry.source.split("/")


def test_lists_of_classes_and_splits(tmp_path, capsys):
    names = [f"T{number}" for number in range(10)]
    for name in names:
        write_off(tmp_path / "raw" / "off" / f"{name}.off", *grid(2, 2))
    (tmp_path / "raw" / "classes.csv").write_text(
        "mesh,class\n" + "".join(f"{n},{'ab'[int(n[1]) % 2]}\n" for n in names)
    )
    (tmp_path / "raw" / "train_list.txt").write_text("\n".join(names[:7]))
    (tmp_path / "raw" / "test_list.txt").write_text("".join(f"off/{name}.off\n" for name in names[7:]))
    toml, found = scanned(tmp_path / "raw", tmp_path, capsys)
    assert (found["class_list"], found["edits"]) == ("classes.csv", [])
    assert found["split_lists"] == {"train": "train_list.txt", "test": "test_list.txt"}
    dataset = read_dataset(str(toml))
    assert dataset.classes == ("a", "b")
    assert {e.id: e.mesh_label for e in dataset.entries} == {f"off/{name}": int(name[1]) % 2 for name in names}
    assert dataset.splits == {f"off/{name}": "train" if number < 7 else "test" for number, name in enumerate(names)}


def test_meshes_alone(tmp_path, capsys):
    write_obj(tmp_path / "raw" / "a.obj", *grid(2, 2))
    toml, found = scanned(tmp_path / "raw", tmp_path, capsys)
    assert (found["reading"], found["edits"]) == ("none", [])
    assert read_dataset(str(toml)).task == "unlabelled"


def test_a_json_file_that_has_labels_of_some_meshes(tmp_path, capsys):
    for number, (name, mesh) in enumerate(MESHES.items()):
        one_json(tmp_path / "raw", name, mesh, [1, 2] * (16 if number else 4))
    write_off(tmp_path / "raw" / "shapes" / "more.off", *MESHES["1"])
    (tmp_path / "raw" / "list.json").write_text("[]")
    (tmp_path / "raw" / "none.json").write_text("{")
    toml, found = scanned(tmp_path / "raw", tmp_path, capsys)
    (labels,) = found["labels"]
    assert (labels["files"], labels["name"], labels["missing"]) == ("labels.json", "{stem}", ["shapes/more.off"])
    assert labels["odd"] == ["shapes/1.off: 8 labels, 32 faces and 18 vertices"]
    assert (found["other_files"], found["labels_without_mesh"]) == ({".json": 2}, [])
    report = run(read_dataset(str(toml)), tmp_path / "out", RECIPES["paper"], jobs=1)
    codes = {entry.id: entry.code for entry in report.index.refused}
    assert codes == {"shapes/1": "label-count", "shapes/more": "bad-label"}


def test_a_json_file_that_is_too_large(tmp_path, capsys, monkeypatch):
    one_json(tmp_path / "raw", "a", MESHES["1"], [1, 2] * 16)
    one_json(tmp_path / "raw", "b", MESHES["1"], [1, 2] * 16)
    assert scanned(tmp_path / "raw", tmp_path, capsys)[1]["reading"] == "labels"
    monkeypatch.setattr("meshshard_prep.scan.one_json.MOST_BYTES", 100)
    assert scanned(tmp_path / "raw", tmp_path, capsys, force=True)[1]["reading"] == "none"


def test_a_json_file_whose_keys_name_several_meshes(tmp_path, capsys):
    for folder in "xy":
        one_json(tmp_path / "raw" / folder, "same", MESHES["1"], [1, 2] * 16)
        (tmp_path / "raw" / folder / "labels.json").rename(tmp_path / "raw" / "labels.json")
    assert scanned(tmp_path / "raw", tmp_path, capsys)[1]["labels"] == []
