import os
import random
import struct
from pathlib import Path

import pytest

from meshshard.errors import InvalidMesh
from meshshard.mesh_files import MESH_SUFFIXES
from meshshard_prep.formats import parse_mesh, read_mesh
from meshshard_prep.mesh import RawMesh

OBJ = b"# cube\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0.5\nf 1 2 3\nf 1/1 3/2 4/3\nf -1 -2 -3\n"
OFF = b"OFF\n4 3 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0.5\n3 0 1 2\n3 0 2 3\n3 3 2 1\n"
PLY_HEADER = (
    b"ply\nformat %s 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    b"element face 3\nproperty list uchar int vertex_indices\nend_header\n"
)
PLY_TEXT = PLY_HEADER % b"ascii" + OFF[10:]
PLY_BINARY = (
    PLY_HEADER % b"binary_little_endian"
    + struct.pack("<12f", 0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0.5)
    + b"".join(struct.pack("<B3i", 3, *face) for face in ((0, 1, 2), (0, 2, 3), (3, 2, 1)))
)
MESHES = {"obj": OBJ, "off": OFF, "ply-text": PLY_TEXT, "ply-binary": PLY_BINARY}


def refused(data, suffix=""):
    with pytest.raises(InvalidMesh) as caught:
        parse_mesh(data, "m", suffix)
    return caught.value


@pytest.mark.parametrize("suffix", [*MESH_SUFFIXES, ".OBJ", ".txt", ""])
@pytest.mark.parametrize("data", MESHES.values(), ids=MESHES)
@pytest.mark.parametrize("mark", [b"", b"\xef\xbb\xbf"])
def test_content_counts_and_not_the_name(data, mark, suffix, tmp_path):
    path = tmp_path / f"mesh{suffix}"
    path.write_bytes(mark + data)
    mesh = read_mesh(path)
    assert mesh.vertices.tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.5]]
    assert mesh.faces.tolist() == [[0, 1, 2], [0, 2, 3], [3, 2, 1]]


def test_place_is_the_path_and_the_line(tmp_path):
    path = tmp_path / "mesh.obj"
    path.write_bytes(OBJ + b"f 1 2 999\n")
    with pytest.raises(InvalidMesh) as caught:
        read_mesh(path)
    assert str(caught.value) == (
        f"{path}:9: a face index lies between 1 and the number of vertices (4), but the face has index 999. "
        "Export or download the file again. [index-out-of-range]"
    )


@pytest.mark.parametrize(
    ("data", "code", "message"),
    [
        (b"", "empty-file", "it has no bytes"),
        (b"\xef\xbb\xbf", "empty-file", "it has no bytes"),
        (b" \r\n\t", "empty-file", "it has 4 bytes, all white space"),
        (
            b"version https://git-lfs.github.com/spec/v1\noid",
            "not-a-mesh",
            "a Git-LFS pointer. Fetch the file itself",
        ),
        (b"\n<!DOCTYPE html><html>", "not-a-mesh", "it is a web page or other XML"),
        (b'<?xml version="1.0"?><svg>', "not-a-mesh", "it is a web page or other XML"),
        (b'{"message": "Not Found"}', "not-a-mesh", "it is JSON"),
        (b"\x1f\x8b\x08", "not-a-mesh", "it is a gzip archive"),
        (b"PK\x03\x04", "not-a-mesh", "it is a zip archive"),
        (b"\x89PNG\r\n\x1a\n", "not-a-mesh", "it is a PNG image"),
        (b"\x7fELF\x02", "not-a-mesh", "it is an ELF program"),
        (
            b"\x4c\x01\x2c\x02\x52\x86\xff\x59",
            "not-a-mesh",
            "it is a COFF object file, which compilers name .obj too",
        ),
        (b"bplist00\xd1" + OBJ, "not-a-mesh", "it is a Safari web archive"),
        (bytes(range(256)) * 9, "not-a-mesh", "it is binary data of an unknown kind"),
        (
            b"solid cube\nfacet normal 0 0 1\n",
            "unsupported-format",
            "OBJ, OFF and PLY are read, but this is an STL file",
        ),
        (b"# made by\nsolid cube\n", "unsupported-format", "an STL file. Convert it to one of these."),
        (b"\0" * 80 + b"\x01\0\0\0" + b"\0" * 50, "unsupported-format", "this is a binary STL file"),
        (b"\0" * 84, "unsupported-format", "this is a binary STL file"),
        (b"MM\x0a\0\0\0\x02\0\x0a\0", "unsupported-format", "this is a 3DS file"),
        (b"glTF\x02\0\0\0", "unsupported-format", "this is a binary glTF file"),
        (b'{"scenes": [], "asset": {}}', "unsupported-format", "this is a glTF file"),
        (b"#VRML V2.0 utf8\n", "unsupported-format", "this is a VRML file"),
        (b"# vtk DataFile Version 3.0\n", "unsupported-format", "this is a VTK file"),
        (b'<?xml version="1.0"?><COLLADA>', "unsupported-format", "this is a COLLADA or X3D file"),
        (OBJ.decode().encode("utf-16"), "bad-encoding", "the text is UTF-8, but it is UTF-16"),
        (OFF.decode().encode("utf-16-le"), "bad-encoding", "it is UTF-16. Save the file as UTF-8"),
        (PLY_TEXT.decode().encode("utf-16-be"), "bad-encoding", "it is UTF-16"),
        (OBJ.replace(b"cube", b"W\xfcrfel"), "bad-encoding", "it has byte 0xfc"),
        (b"hello world\n", "bad-line", "an OBJ statement such as v or f, but this one has 'hello'"),
        (b"OFF BINARY\n\0\0\0\x01\xff\xff", "unsupported-format", "this one is binary"),
    ],
)
def test_other_content_is_named(data, code, message):
    error = refused(data)
    assert error.code == code
    assert message in str(error)
    assert error.place.startswith("m")
    assert error.advice


@pytest.mark.parametrize(("suffix", "word"), [(".off", "OFF"), (".PLY", "ply")])
def test_name_only_helps_to_word_a_refusal(suffix, word):
    error = refused(b"8 6 0\n0 0 0\n", suffix)
    assert error.code == "bad-line"
    assert f"a file named {suffix} starts with the word {word}, but this one starts with '8'" in str(error)


@pytest.mark.parametrize("make", [Path.mkdir, os.mkfifo, lambda _: None, lambda path: path.symlink_to(path)])
def test_what_is_no_readable_file(make, tmp_path):
    path = tmp_path / "mesh.obj"
    make(path)
    with pytest.raises(InvalidMesh, match="the file can be read, but ") as caught:
        read_mesh(path)
    assert (caught.value.code, caught.value.place) == ("unreadable", str(path))


def test_operating_system_that_refuses(tmp_path, monkeypatch):
    def refuse(*_):
        raise PermissionError(13, "Permission denied")

    path = tmp_path / "mesh.obj"
    path.write_bytes(OBJ)
    monkeypatch.setattr(Path, "open", refuse)
    with pytest.raises(InvalidMesh, match=r"the system says 'Permission denied'.*\[unreadable\]"):
        read_mesh(path)


def mesh_or_refusal(data):
    try:
        mesh = parse_mesh(data, "m")
    except InvalidMesh as error:
        return error.code
    assert isinstance(mesh, RawMesh)
    assert 0 <= mesh.faces.min() <= mesh.faces.max() < len(mesh.vertices)
    return "read"


@pytest.mark.parametrize("data", MESHES.values(), ids=MESHES)
def test_every_truncation_is_a_mesh_or_a_refusal(data):
    outcomes = [mesh_or_refusal(data[:length]) for length in range(len(data) + 1)]
    assert outcomes[0] == "empty-file"
    assert outcomes[-1] == "read"


@pytest.mark.parametrize("data", [OFF, PLY_TEXT, PLY_BINARY])
def test_no_truncation_of_a_counted_format_is_read(data):
    last = len(data.rstrip()) if data is not PLY_BINARY else len(data)
    assert "read" not in [mesh_or_refusal(data[:length]) for length in range(last)]


@pytest.mark.parametrize("data", MESHES.values(), ids=MESHES)
def test_every_damage_is_a_mesh_or_a_refusal(data):
    generator = random.Random(20240229)
    outcomes = set()
    for _ in range(400):
        damaged = bytearray(data)
        for _ in range(generator.randint(1, 3)):
            start = generator.randrange(len(damaged))
            kind = generator.choice(["flip", "byte", "cut", "repeat", "zeros"])
            stop = start + generator.randint(1, 12)
            if kind == "flip":
                damaged[start] ^= 1 << generator.randrange(8)
            elif kind == "byte":
                damaged[start] = generator.randrange(256)
            elif kind == "cut":
                del damaged[start:stop]
            elif kind == "repeat":
                damaged[start:start] = damaged[start:stop]
            else:
                damaged[start:stop] = bytes(stop - start)
        outcomes.add(mesh_or_refusal(bytes(damaged)))
    assert {"read", "index-out-of-range"} < outcomes
