"""Labels written for other tools, and read again."""

from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from polygons import POLYGONS, obj_text
from samples import sample, write_dataset

from meshshard import open_dataset
from meshshard.errors import InvalidMesh, UsageError
from meshshard.export.formats import find_exporter
from meshshard.export.write import write_export
from meshshard.recipe import RECIPES
from meshshard_prep.formats import parse_mesh
from meshshard_prep.labels import LabelFile, Labels, read_labels
from meshshard_prep.labels.export import labels_of_edges, labels_of_file
from meshshard_prep.pipeline import features_of

LIGHT = replace(RECIPES["paper"], name="light", times=(0.1, 1.0), hks_tolerance=1e-2)
CLASSES = {number: number for number in range(3)}
FROM_ONE = {number + 1: number for number in range(3)}


def stored(name, seed=0):
    """A sample of a mesh whose polygons have random labels, and those labels."""
    vertices, faces = POLYGONS[name]
    mesh = parse_mesh(obj_text(vertices, faces).encode(), name)
    labels = np.random.default_rng(seed).integers(-1, 3, mesh.polygons)
    found = features_of(mesh, LIGHT, Labels(domain="face", faces=labels[mesh.face_source].astype("i2")))
    return mesh, labels, replace(found, id=name)


def written(form, folder, mesh):
    dataset = open_dataset(write_dataset(folder, [sample(1)], [""]))
    return find_exporter(form, dataset).encode(mesh)


def read(data, mesh, domain, classes):
    return read_labels(LabelFile(path=Path("x"), classes=classes, domains=(domain,)), data, mesh)


@pytest.mark.parametrize("name", POLYGONS)
@pytest.mark.parametrize("seed", [0, 1])
def test_seg_has_the_label_of_each_polygon_and_is_read_again(name, seed, tmp_path):
    mesh, labels, found = stored(name, seed)
    data = written("seg", tmp_path, found)
    assert data == "".join(f"{label}\n" for label in labels).encode()
    np.testing.assert_array_equal(read(data, mesh, "face", CLASSES).faces, found.face_labels)


@pytest.mark.parametrize("name", [name for name in POLYGONS if name != "quads"])
def test_eseg_has_a_label_for_each_edge_in_meshcnns_order(name, tmp_path):
    mesh, labels, found = stored(name)
    of_edge = {}
    for face, label in zip(mesh.faces.tolist(), labels.tolist(), strict=True):
        for edge in zip(face, [*face[1:], face[0]], strict=True):
            of_edge.setdefault(frozenset(edge), []).append(label)
    votes = [Counter(label + 1 for label in around if label >= 0) for around in of_edge.values()]
    expected = [min(v, key=lambda label: (-v[label], label)) if v else -1 for v in votes]
    data = written("eseg", tmp_path, found)
    assert data == "".join(f"{label}\n" for label in expected).encode()
    edges = read(data, mesh, "edge", FROM_ONE)
    same = np.full(len(labels), 2, dtype="i2")
    assert edges.domain == "edge"
    one_class = written("eseg", tmp_path, replace(found, face_labels=same))
    np.testing.assert_array_equal(read(one_class, mesh, "edge", FROM_ONE).faces, same)


def test_a_polygon_has_the_label_of_most_of_its_triangles():
    _, labels, found = stored("quads")
    pentagon = int(np.argmax(np.bincount(found.face_source)))
    triangles = np.flatnonzero(found.face_source == pentagon)
    for of_triangles, expected in (([2, 0, 2], 2), ([2, 1, 0], 0), ([-1, -1, 1], 1), ([-1, -1, -1], -1)):
        changed = found.face_labels.copy()
        changed[triangles] = of_triangles
        assert labels_of_file(replace(found, face_labels=changed), LIGHT).tolist() == [
            expected if number == pentagon else label for number, label in enumerate(labels.tolist())
        ]


def test_a_step_keeps_the_lines_of_the_file_and_simplify_does_not():
    _, labels, found = stored("quads")
    kept = found.face_source != 2  # as if the step largest_component had left it out
    rows = {name: getattr(found, name)[kept] for name in ("faces", "face_adjacency", "face_source", "face_labels")}
    changed = replace(found, vertex_source=np.arange(len(found.vertices), dtype="i4"), **rows)
    stepped = replace(LIGHT, steps=("largest_component",))
    labels[2] = -1
    assert labels_of_file(changed, stepped).tolist() == labels.tolist()
    assert labels_of_file(changed, replace(stepped, simplify=4)).tolist() == rows["face_labels"].tolist()
    assert len(labels_of_edges(changed)) == len(
        {frozenset(e) for f in changed.faces.tolist() for e in zip(f, [*f[1:], f[0]], strict=True)}
    )


NOTES = {
    ("seg", "faces", "steps"): "",
    ("seg", "faces", "simplify"): "each line is of a face of the simplified mesh, not of the mesh file",
    ("seg", "vertices", "steps"): "each line is of a vertex of the stored mesh, which the recipe changed",
    ("eseg", "faces", "steps"): "each line is of an edge of the stored mesh, which the recipe changed",
    ("eseg", "faces", ""): "",
    ("seg", "vertices", ""): "",
}


@pytest.mark.parametrize(("form", "labelled", "setting"), NOTES)
def test_lines_that_are_not_of_the_mesh_file_are_said_to_be(form, labelled, setting, tmp_path):
    change = {"steps": {"steps": ("weld",)}, "simplify": {"simplify": 8}, "": {}}[setting]
    mesh = sample(1) if labelled == "faces" else of_vertices(1)
    mesh = replace(mesh, vertex_source=np.arange(len(mesh.vertices), dtype="i4") if setting else None)
    folder = write_dataset(tmp_path / "shards", [mesh], [""], recipe=replace(RECIPES["paper"], **change))
    dataset = open_dataset(folder)
    exporter = find_exporter(form, dataset)
    said = NOTES[form, labelled, setting]
    assert exporter.note.startswith(said)
    assert bool(exporter.note) == bool(said)
    report = write_export(dataset, [0], form, exporter, tmp_path / "out")
    assert report.get("note", "") == exporter.note


def test_edges_of_polygons_are_refused():
    with pytest.raises(InvalidMesh, match=r"quads: edges .* 9 faces, which were cut into .*--to seg.*not-triangles"):
        labels_of_edges(stored("quads")[2])


def of_vertices(number):
    mesh = sample(number)
    labels = (np.arange(len(mesh.vertices)) % 3 - 1).astype("i2")
    return replace(mesh, face_labels=None, vertex_labels=labels, label_domain="vertex")


def test_labelled_vertices_have_a_line_each_and_edges_of_them_are_refused(tmp_path):
    mesh = of_vertices(1)
    dataset = open_dataset(write_dataset(tmp_path, [mesh], [""]))
    assert find_exporter("seg", dataset).encode(mesh).split() == [b"%d" % label for label in mesh.vertex_labels]
    with pytest.raises(
        UsageError, match=r"has labels of vertices.*try --to seg, which writes a line for each vertex"
    ):
        find_exporter("eseg", dataset)


@pytest.mark.parametrize("form", ["seg", "eseg"])
def test_what_has_no_such_labels_is_refused(form, tmp_path):
    dataset = open_dataset(write_dataset(tmp_path / "a", [sample(1)], [""]))
    with pytest.raises(InvalidMesh, match=r"mesh002: .* but this mesh has none.*\[no-labels\]"):
        find_exporter(form, dataset).encode(sample(2, labels="none"))
    samples = [sample(1, labels="none")]
    bare = open_dataset(write_dataset(tmp_path / "b", samples, [""], task="unlabelled", classes=()))
    with pytest.raises(UsageError, match="has no labels of faces or vertices"):
        find_exporter(form, bare)
