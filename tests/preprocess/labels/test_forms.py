"""Labels of generated meshes, written in every form by other means than the project's, come back as they were."""

import io
import json
import struct
from pathlib import Path

import numpy as np
import pytest
from polygons import POLYGONS, fans, obj_text

from meshshard.errors import InvalidMesh
from meshshard_prep.formats import parse_mesh
from meshshard_prep.labels import FORMS, LabelFile, class_table, read_labels

NAMES = ["upper arm", "Leg", "part#3", "-x"]
"""What a class may be called: with blanks, signs and what begins a comment elsewhere."""
BY_NAME = {name: number for number, name in enumerate(NAMES)}
BY_INTEGER = {3: 0, 7: 1, 250: 2, 255: 3}


def read(data, form, mesh, classes, name="", **meaning):
    return read_labels(LabelFile(path=Path("x"), form=form, name=name, classes=classes, **meaning), data, mesh)


def labelled(name, seed=0):
    """Vertices, polygons, the mesh, and a random class, or none, for each polygon."""
    vertices, faces = POLYGONS[name]
    mesh = parse_mesh(obj_text(vertices, faces).encode(), name)
    return vertices, faces, mesh, np.random.default_rng(seed).integers(-1, 4, len(faces)).tolist()


def integer(label):
    return label if label < 0 else list(BY_INTEGER)[label]


@pytest.fixture(params=list(POLYGONS))
def case(request):
    return labelled(request.param)


def test_lines(case):
    _, faces, mesh, labels = case
    for text, classes in (
        ("".join(f"{integer(label)}\n" for label in labels), BY_INTEGER),
        ("".join(f" {NAMES[label] if label >= 0 else -1} \r\n" for label in labels), BY_NAME),
    ):
        found = read(text.encode(), "lines", mesh, classes, domains=("face",))
        assert found.faces.tolist() == fans(faces, labels)
        assert (found.domain, found.rule, found.vertices) == ("face", "", None)


@pytest.mark.parametrize("kind", ["<i2", ">i4", "<i8", ">i2", "u2", "<u8"])
@pytest.mark.parametrize("columns", [(), (1,)])
def test_npy(case, kind, columns):
    _, faces, mesh, labels = case
    if "u" in kind:
        labels = [max(label, 0) for label in labels]
    stream = io.BytesIO()
    np.save(stream, np.array([integer(label) for label in labels], dtype=kind).reshape(-1, *columns))
    found = read(stream.getvalue(), "npy", mesh, BY_INTEGER, domains=("face",))
    assert found.faces.tolist() == fans(faces, labels)


@pytest.mark.parametrize("version", [(1, 0), (2, 0), (3, 0)])
def test_versions_of_npy(version):
    stream = io.BytesIO()
    np.lib.format.write_array(stream, np.array([7, 3, 7], order="F"), version=version)
    assert FORMS["npy"](stream.getvalue(), "", "").classes(BY_INTEGER).tolist() == [1, 0, 1]


@pytest.mark.parametrize("indent", [None, 1])
def test_json(case, indent):
    _, faces, mesh, labels = case
    names = [None if label < 0 else NAMES[label] for label in labels]
    integers = [integer(label) for label in labels]
    for content, name, classes in (
        (names, "", BY_NAME),
        ({"author": "x", "labels": integers}, "", BY_INTEGER),
        ({"labels": [1], "parts": integers}, "parts", BY_INTEGER),
    ):
        for mark in (b"", b"\xef\xbb\xbf"):
            data = mark + json.dumps(content, indent=indent).encode()
            assert read(data, "json", mesh, classes, name, domains=("face",)).faces.tolist() == fans(faces, labels)


def ply_bytes(vertices, faces, kind, vertex, face, order=""):
    """By hand: further columns of vertices and of faces, given as name -> values. `order` is that of the bytes, of
    struct, and none for text."""
    form = {"": "ascii", "<": "binary_little_endian", ">": "binary_big_endian"}[order]
    lines = ["ply", f"format {form} 1.0", f"element vertex {len(vertices)}"]
    lines += [f"property double {axis}" for axis in "xyz"] + [f"property {kind} {name}" for name in vertex]
    lines += [f"element face {len(faces)}", "property list uchar int vertex_indices"]
    lines += [f"property {kind} {name}" for name in face]
    of_kind = {"short": "h", "int32": "i", "float": "f", "double": "d"}[kind]
    rows = [
        ("ddd" + of_kind * len(vertex), [*position, *columns])
        for position, *columns in zip(np.asarray(vertices).tolist(), *vertex.values(), strict=True)
    ]
    rows += [
        (f"B{len(corners)}i" + of_kind * len(face), [len(corners), *corners, *columns])
        for corners, *columns in zip(faces, *face.values(), strict=True)
    ]
    body = [
        struct.pack(order + types, *row) if order else (" ".join(map(str, row)) + "\n").encode()
        for types, row in rows
    ]
    return "\n".join([*lines, "end_header", ""]).encode() + b"".join(body)


@pytest.mark.parametrize("kind", ["short", "int32", "float", "double"])
@pytest.mark.parametrize("order", ["", "<", ">"])
def test_ply(case, kind, order):
    vertices, faces, _, labels = case
    of_vertices = [integer(number % 5 - 1) for number in range(len(vertices))]
    of_faces = [integer(label) for label in labels]
    vertex = {"other": of_vertices[::-1], "part": of_vertices}
    data = ply_bytes(vertices, faces, kind, vertex, {"label": of_faces, "other": of_faces[::-1]}, order)
    mesh = parse_mesh(data, "m.ply")
    found = read(data, "ply", mesh, BY_INTEGER, "label")
    assert (found.domain, found.faces.tolist()) == ("face", fans(faces, labels))
    found = read(data, "ply", mesh, BY_INTEGER, "part")
    assert (found.domain, found.vertices.tolist()) == ("vertex", [number % 5 - 1 for number in range(len(vertices))])


def test_a_property_of_both_elements_of_a_ply_is_named_with_its_element():
    vertices, faces, _, labels = labelled("box")
    of_faces = [integer(label) for label in labels]
    data = ply_bytes(vertices, faces, "int32", {"label": [3] * len(vertices)}, {"label": of_faces})
    mesh = parse_mesh(data, "m.ply")
    assert read(data, "ply", mesh, BY_INTEGER, "face label").faces.tolist() == labels
    assert read(data, "ply", mesh, BY_INTEGER, "vertex label").vertices.tolist() == [0] * len(vertices)


@pytest.mark.parametrize(("form", "keywords"), [("obj-group", "go"), ("obj-material", ["usemtl"])])
@pytest.mark.parametrize("line_end", ["\n", "\r\n", "\r"])
def test_obj(case, form, keywords, line_end):
    vertices, faces, _, labels = case
    first = len(labels) // 3
    labels = [-1] * first + labels[first:]  # those before any statement

    def before(number):
        if number < first or (number > first and labels[number] == labels[number - 1]):
            return ""
        name = NAMES[labels[number]] if labels[number] >= 0 else ""
        return f"s off\n  {keywords[number % len(keywords)]}  {name} # {number}\n"

    data = obj_text(vertices, faces, before).replace("\n", line_end).encode()
    found = read(data, form, parse_mesh(data, "m.obj"), BY_NAME)
    assert (found.domain, found.faces.tolist()) == ("face", fans(faces, labels))


def test_continued_lines_and_other_statements_of_an_obj():
    text = "v 0 0 0\nv 1 0 0\nv 0 1 0\ng upper\\\narm #1\nusemtl red\nf 1 2 \\\n 3\n#g Leg\nf 1 2 3\\\n\n"
    text += "g Leg#9 # no\nf 3 2 1\n"
    found = FORMS["obj-group"](text.encode(), "", "m.obj")
    assert (found.values, found.which.tolist()) == (("upper arm", "Leg#9"), [0, 0, 1])
    assert [found.place(i) for i in range(3)] == ["m.obj:7", "m.obj:10", "m.obj:13"]
    assert FORMS["obj-material"](text.encode(), "", "m.obj").values == ("red",)


@pytest.mark.parametrize("width", [1, 7, 10_000])
def test_psb(case, width):
    _, faces, mesh, labels = case
    names = ["upper arm", "Leg", "tail_1", "x-1"]
    lines = []
    for part in (2, 0, 1, 3, 0):  # one part is named again, with no new face
        numbers = [str(i + 1) for i, label in enumerate(labels) if label == part][::-1]
        lines += [names[part], *(" ".join(numbers[i : i + width]) for i in range(0, len(numbers), width)), ""]
    found = read("\r\n".join(lines).encode(), "psb", mesh, {name: i for i, name in enumerate(names)})
    assert (found.domain, found.faces.tolist()) == ("face", fans(faces, labels))


@pytest.mark.parametrize("write", ["{}", "{}.0", "{}e+00", "{:.6f}"])
def test_last_column(case, write):
    vertices, _, mesh, _ = case
    labels = [number % 5 - 1 for number in range(len(vertices))]
    rows = np.random.default_rng(0).random((len(vertices), 6)).tolist()
    text = "".join(
        f"{' '.join(map(repr, row))}\t{write.format(integer(label))}\n"
        for row, label in zip(rows, labels, strict=True)
    )
    found = read(text.encode(), "last-column", mesh, BY_INTEGER, domains=("vertex",))
    assert (found.domain, found.vertices.tolist()) == ("vertex", labels)


def test_classes_of_names_are_in_alphabetical_order(tmp_path):
    (tmp_path / "a.txt").write_text("leg\n1 2\narm\n3\n")
    (tmp_path / "b.json").write_text('{"labels": ["tail", null, "arm"]}')
    files = [LabelFile(path=tmp_path / "a.txt", form="psb"), LabelFile(path=tmp_path / "b.json", form="json")]
    assert class_table(files, (), tmp_path) == (("arm", "leg", "tail"), {"arm": 0, "leg": 1, "tail": 2})


def test_a_domain_that_was_not_asked_for_is_refused():
    vertices, faces, _, labels = labelled("box")
    data = ply_bytes(vertices, faces, "int32", {}, {"label": [integer(label) for label in labels]})
    with pytest.raises(InvalidMesh, match=r"the labels are of vertices, but these are of faces.*labels.domain"):
        read(data, "ply", parse_mesh(data, "m.ply"), BY_INTEGER, "label", domains=("vertex",))
