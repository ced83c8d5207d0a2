"""What a run stores of labels in forms of their own, and what an export gives back."""

from pathlib import Path

import numpy as np
from polygons import POLYGONS, fans, obj_text
from program import meshshard

from meshshard import open_dataset
from meshshard.recipe import RECIPES
from meshshard_prep.datasets import Entry, LabelFile, RawDataset
from meshshard_prep.labels import class_table
from meshshard_prep.labels.convert import EDGES_TO_FACES, FACES_TO_VERTICES
from meshshard_prep.run import run

PARTS = ("arm", "leg", "torso")


def raw_folder(folder: Path):
    """Meshes whose groups are their labels, and an edge file for one of them. Id -> class of each polygon."""
    labels = {}
    for number, name in enumerate(("quads", "torus", "fin")):
        vertices, faces = POLYGONS[name]
        labels[name] = np.random.default_rng(number).integers(0, 3, len(faces)).tolist()
        text = obj_text(vertices, faces, lambda i, of=labels[name]: f"g {PARTS[of[i]]}\n")
        (folder / f"{name}.obj").write_text(text)
    return labels


def stored(folder, out, **meaning):
    files = [LabelFile(path=path, form="obj-group", **meaning) for path in sorted(folder.glob("*.obj"))]
    classes, table = class_table(files, (), folder)
    entries = [
        Entry(
            id=file.path.stem,
            path=file.path,
            source=file.path.name,
            labels=LabelFile(path=file.path, form=file.form, classes=table, **meaning),
        )
        for file in files
    ]
    raw = RawDataset(name="raw", task="segmentation", classes=classes, entries=tuple(entries))
    assert run(raw, out, RECIPES["paper"], jobs=1).ok
    return open_dataset(out)


def test_groups_are_stored_and_exported_as_they_were(tmp_path):
    labels = raw_folder(tmp_path)
    dataset = stored(tmp_path, tmp_path / "out")
    assert dataset.classes == PARTS
    for mesh in dataset:
        assert mesh.face_labels.tolist() == fans(POLYGONS[mesh.id][1], labels[mesh.id])
        assert (mesh.label_domain, mesh.label_rule, mesh.vertex_labels) == ("face", "", None)
    for form, status in (("seg", 0), ("eseg", 1)):  # one mesh has polygons, and no labels of edges
        assert meshshard("export", tmp_path / "out", "--to", form, "--out", tmp_path / form)[0] == status
    for name, of_faces in labels.items():
        assert [int(line) for line in (tmp_path / "seg" / f"{name}.seg").read_text().split()] == of_faces
    assert sorted(path.name for path in (tmp_path / "eseg").glob("*.eseg")) == ["fin.eseg", "torus.eseg"]


def test_the_rule_of_a_conversion_is_stored(tmp_path):
    raw_folder(tmp_path)
    for mesh in stored(tmp_path, tmp_path / "out", to="vertex"):
        assert (mesh.label_domain, mesh.label_rule, mesh.face_labels) == ("face", FACES_TO_VERTICES, None)
        assert mesh.diagnostics["unlabelled"] == mesh.diagnostics["unreferenced_vertices"]
    (path,) = (file for file in tmp_path.glob("torus.obj"))
    edges = tmp_path / "torus.eseg"
    edges.write_text("1\n" * 288)
    labels = LabelFile(path=edges, classes={1: 0}, domains=("edge",))
    entry = Entry(id="torus", path=path, source="torus.obj", labels=labels)
    raw = RawDataset(name="edges", task="segmentation", classes=("one",), entries=(entry,))
    assert run(raw, tmp_path / "edges", RECIPES["paper"], jobs=1).ok
    (mesh,) = open_dataset(tmp_path / "edges")
    assert (mesh.label_domain, mesh.label_rule, set(mesh.face_labels)) == ("edge", EDGES_TO_FACES, {0})
