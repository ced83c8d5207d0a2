"""Rows read at once are those that plyfile reads one by one, whatever the file."""

import random
import struct

import numpy as np
import pytest
from polygons import POLYGONS, quads

from meshshard.errors import InvalidMesh
from meshshard_prep.formats import ply
from meshshard_prep.formats.ply_header import read_header
from meshshard_prep.formats.ply_rows import even_rows


def binary(vertices, faces, order, length="uchar", notes=()):
    """A PLY whose faces have a label and a further list, with an element of lists that has the lengths `notes`."""
    form = {"<": "binary_little_endian", ">": "binary_big_endian"}[order]
    header = ["ply", f"format {form} 1.0", f"element vertex {len(vertices)}"]
    header += [*(f"property float {axis}" for axis in "xyz"), "property ushort label", f"element face {len(faces)}"]
    header += [f"property list {length} int vertex_indices", "property uchar red", "property list uchar double uv"]
    header += [f"element note {len(notes)}", "property list int short words", "end_header", ""]
    body = [struct.pack(f"{order}fffH", *point, number % 9) for number, point in enumerate(np.asarray(vertices))]
    size = {"uchar": "B", "char": "b", "int": "i"}[length]
    for face in faces:
        body.append(struct.pack(f"{order}{size}{len(face)}iBB2d", len(face), *face, 7, 2, 0.5, -1.5))
    body += [struct.pack(f"{order}i{count}h", count, *range(count)) for count in notes]
    return "\n".join(header).encode() + b"".join(body)


def rows_of(data):
    header = read_header(data, "m")
    return even_rows(data[header.end :], header)


def outcome(data, one_by_one, monkeypatch):
    """What the mesh is, or why it is refused; with all rows read by plyfile or not."""
    with monkeypatch.context() as patch:
        if one_by_one:
            patch.setattr(ply, "even_rows", lambda *_: None)
        try:
            mesh = ply.parse_ply(data, "m")
        except InvalidMesh as error:
            return str(error)
    return mesh.vertices.tobytes(), mesh.faces.tobytes(), mesh.face_source.tobytes(), mesh.polygons


@pytest.mark.parametrize("name", POLYGONS)
@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("length", ["uchar", "char", "int"])
def test_both_ways_give_the_same_mesh(name, order, length, monkeypatch):
    data = binary(*POLYGONS[name], order, length, notes=(3, 3))
    assert (rows_of(data) is None) == (name == "quads")
    assert outcome(data, False, monkeypatch) == outcome(data, True, monkeypatch)


@pytest.mark.parametrize("notes", [(), (0,), (4, 4, 4), (0, 1), (2000,)])
def test_lists_of_other_elements(notes, monkeypatch):
    vertices, faces = POLYGONS["box"]
    data = binary(vertices, faces, "<", notes=notes)
    assert (rows_of(data) is None) == (notes in ((0, 1), (2000,)))
    assert outcome(data, False, monkeypatch) == outcome(data, True, monkeypatch)


def test_columns_have_the_values_that_plyfile_finds(monkeypatch):
    data = binary(*POLYGONS["bumpy"], ">", notes=(3, 3))
    header = read_header(data, "m")
    at_once = ply.read_rows(data, header, "m")
    monkeypatch.setattr(ply, "even_rows", lambda *_: None)
    for name, rows in ply.read_rows(data, header, "m").items():
        for key in rows.dtype.names:
            np.testing.assert_array_equal(np.array(rows[key].tolist()), at_once[name][key])


def test_every_damage_ends_alike(monkeypatch):
    rng = random.Random(0)
    vertices, faces = POLYGONS["tetrahedron"]
    whole = [binary(vertices, faces, order, "char", notes=(2,)) for order in "<>"]
    whole.append(binary(*quads(1, 1), "<"))
    with np.errstate(all="ignore"):
        for number in range(300):
            data = bytearray(rng.choice(whole))
            for _ in range(rng.choice([1, 1, 2])):
                at = rng.randrange(len(data) // 2, len(data))
                data[at : at + rng.randrange(3)] = rng.choice([b"", b"\xff", b"\0", b"\3", rng.randbytes(2)])
            found = outcome(bytes(data), False, monkeypatch)
            assert found == outcome(bytes(data), True, monkeypatch), number


@pytest.mark.parametrize("name", [b"ushort x", b"ushort \xe9"])
def test_a_column_that_plyfile_cannot_name_is_left_to_it(name, monkeypatch):
    data = binary(*POLYGONS["box"], "<").replace(b"ushort label", name)
    assert rows_of(data) is None
    assert outcome(data, False, monkeypatch) == outcome(data, True, monkeypatch)
