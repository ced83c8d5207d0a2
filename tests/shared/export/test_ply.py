import io
from dataclasses import replace

import numpy as np
import pytest
from plyfile import PlyData
from samples import sample, toy_dataset, write_dataset

from meshshard import UsageError, open_dataset
from meshshard.export.ply import by_feature, exporter, feature_of, labelled
from meshshard.index import read_index
from meshshard.palette import class_colour, colours_between


def read(content):
    return PlyData.read(io.BytesIO(content))


def rgb(element):
    return np.stack([element[name] for name in ("red", "green", "blue")], axis=1)


@pytest.mark.parametrize("level", [0, 1, 2])
def test_another_library_reads_the_mesh_where_its_file_had_it(level):
    mesh = sample(level, level=level)
    ply = read(labelled(mesh))
    assert (ply.byte_order, ply.text) == ("<", False)
    places = np.stack([ply["vertex"][axis] for axis in "xyz"], axis=1)
    assert places.dtype == np.float64
    np.testing.assert_array_equal(places, mesh.vertices * mesh.scale + mesh.centre)
    np.testing.assert_array_equal(np.vstack(ply["face"]["vertex_indices"]), mesh.faces)
    np.testing.assert_array_equal(ply["face"]["label"], mesh.face_labels)
    for label in range(3):
        expected = bytes.fromhex(class_colour(label)[1:])
        assert {tuple(row) for row in rgb(ply["face"])[mesh.face_labels == label]} <= {tuple(expected)}


def test_labels_of_vertices_colour_vertices():
    labels = np.array([0, 1, 2, -1, 0, 1], dtype="i2")
    ply = read(labelled(sample(0, level=0, labels=None, vertex_labels=labels)))
    np.testing.assert_array_equal(ply["vertex"]["label"], labels)
    assert rgb(ply["vertex"])[3].tolist() == [0xBB] * 3
    assert "label" not in ply["face"].data.dtype.names


@pytest.mark.parametrize(("element", "labels"), [("face", "face_labels"), ("vertex", "vertex_labels")])
def test_classes_have_the_colours_of_the_data_set(tmp_path, element, labels):
    mesh = sample(0, level=0, labels="faces" if element == "face" else None)
    if element == "vertex":
        mesh = replace(mesh, vertex_labels=np.array([0, 1, 2, -1, 0, 1], dtype="i2"))
    folder = write_dataset(tmp_path, [mesh], [""])
    replace(read_index(folder), colours=("#010203", "#040506", "#070809")).write(folder)
    ply = read(exporter(open_dataset(folder)).encode(mesh))
    expected = [
        [3 * label + 1, 3 * label + 2, 3 * label + 3] if label >= 0 else [0xBB] * 3 for label in getattr(mesh, labels)
    ]
    assert rgb(ply[element]).tolist() == expected


def test_a_mesh_without_labels_among_labelled_ones_is_grey():
    ply = read(labelled(sample(0, level=0, labels=None)))
    assert set(ply["face"]["label"]) == {-1}
    assert set(rgb(ply["face"]).ravel()) == {0xBB}


@pytest.mark.parametrize("name", ["hks:3", "dihedral", "vertex_normals:2"])
def test_a_feature_is_told_exactly_and_coloured_from_least_to_greatest(name):
    mesh = sample(2)
    field, _, column = name.partition(":")
    values = getattr(mesh, field)[:, int(column)] if column else getattr(mesh, field)
    ply = read(by_feature(mesh, name))
    np.testing.assert_array_equal(ply["vertex"]["quality"], values)
    assert ply.comments == [f"colours: {name}, {float(values.min())} to {float(values.max())}"]
    colours = rgb(ply["vertex"]).astype(int)
    assert colours[values.argmin()].tolist() == [0x44, 0x01, 0x54]
    assert colours[values.argmax()].tolist() == [0xFD, 0xE7, 0x25]
    green = colours[np.argsort(values), 1]
    assert (np.diff(green) >= 0).all()  # green rises all along the map


def test_unused_vertices_do_not_stretch_the_colours():
    mesh = sample(0, level=1)
    hks = mesh.hks.copy()
    hks[5] = 0
    ply = read(by_feature(replace(mesh, hks=hks), "hks:0"))
    others = np.delete(np.arange(len(hks)), 5)
    least = others[hks[others, 0].argmin()]
    assert rgb(ply["vertex"])[least].tolist() == [0x44, 0x01, 0x54]


def test_colours_are_viridis_and_a_constant_is_dark():
    import matplotlib as mpl

    values = np.linspace(-2, 3, 501)
    expected = 255 * mpl.colormaps["viridis"](np.linspace(0, 1, 501))[:, :3]
    np.testing.assert_allclose(colours_between(values, -2.0, 3.0), expected, atol=6)
    assert colours_between(np.array([1.0, 1.0]), 1.0, 1.0).tolist() == [[0x44, 0x01, 0x54]] * 2


def test_the_default_is_labels_where_there_are_some(tmp_path):
    bare = write_dataset(tmp_path / "bare", [sample(0, labels=None)], ["train"], task="unlabelled", classes=())
    assert "label" in read(exporter(open_dataset(toy_dataset(tmp_path / "toy"))).encode(sample(0)))["face"]
    assert "quality" in read(exporter(open_dataset(bare)).encode(sample(0)))["vertex"]
    with pytest.raises(UsageError, match="no labels of faces or vertices; try --colour dihedral"):
        exporter(open_dataset(bare), "label")


@pytest.mark.parametrize(
    ("colour", "message"),
    [
        (
            "curvature",
            r"--colour curvature: meshes have label, vertices, vertex_normals, dihedral, hks, vertex_areas;",
        ),
        ("face_labels", "meshes have label, vertices"),
        ("dihedral_signed", "meshes have label, vertices"),
        ("hks", "hks has the columns 0 to 15; try --colour hks:0"),
        ("hks:16", "hks has the columns 0 to 15"),
        ("hks:x", "hks has the columns 0 to 15"),
        ("dihedral:1", "dihedral has the columns 0 to 0"),
    ],
)
def test_other_colours_are_refused(tmp_path, colour, message):
    with pytest.raises(UsageError, match=message):
        exporter(open_dataset(toy_dataset(tmp_path)), colour)
    assert feature_of(sample(0), "dihedral:0").shape == (18,)
