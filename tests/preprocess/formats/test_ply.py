import struct
import tracemalloc

import numpy as np
import pytest

from meshshard.errors import InvalidMesh
from meshshard_prep.formats.ply import parse_ply
from meshshard_prep.formats.ply_header import is_ply

POINTS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
POLYGONS = [(0, 1, 2), (3, 2, 1, 0)]
HEADER = (
    "ply\nformat {format} 1.0\ncomment made by hand\nelement vertex 4\nproperty float x\nproperty float y\n"
    "property float z\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n"
)
TEXT = HEADER.format(format="ascii") + "0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n4 3 2 1 0\n"


def binary(order="<", header=HEADER):
    rows = b"".join(struct.pack(f"{order}3f", *point) for point in POINTS)
    rows += b"".join(struct.pack(f"{order}B{len(face)}i", len(face), *face) for face in POLYGONS)
    return header.format(format="binary_" + {"<": "little", ">": "big"}[order] + "_endian").encode() + rows


def swapped_elements():
    header = (
        "ply\nformat ascii 1.0\nobj_info\nelement face 2\nproperty uchar red\nproperty list uchar uint vertex_index\n"
        "element vertex 4\nproperty double z\nproperty double nx\nproperty double x\nproperty double y\n"
        "element edge 1\nproperty int a\nproperty list uchar float empty\nend_header\n"
    )
    return (header + "7 3 0 1 2\n8 4 3 2 1 0\n0 9 0 0\n0 9 1 0\n0 9 1 1\n0 9 0 1\n5 0\n").encode()


def columns_of_one_name():
    header = TEXT.replace("property float x\n", "property uchar gap\nproperty float x\nproperty uchar gap\n")
    return header.replace("\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n", "\n9 0 9 0 0\n9 1 9 0 0\n9 1 9 1 0\n9 0 9 1 0\n").encode()


def refused(data):
    with pytest.raises(InvalidMesh) as caught:
        parse_ply(data if isinstance(data, bytes) else data.encode(), "m.ply")
    return caught.value


@pytest.mark.parametrize(
    "data",
    [
        TEXT.encode(),
        TEXT.rstrip().encode(),
        TEXT.replace("\n", "\r\n").encode(),
        TEXT.replace("\n", "\r").encode(),
        TEXT.replace("end_header\n", "\n end_header \n").encode(),
        TEXT.replace("made by hand", "von Händen").encode("latin-1"),
        TEXT.replace("element vertex 4", "element  vertex\t4 ").encode(),
        TEXT.replace("float", "float64").encode(),
        TEXT.replace("float", "short").replace("uchar int", "int8 uint16").encode(),
        binary("<"),
        binary(">"),
        binary("<", HEADER.replace("\n", "\r\n")),
        binary("<", HEADER.replace("\n", "\r")),
        swapped_elements(),
        columns_of_one_name(),
    ],
)
def test_variants_of_one_mesh(data):
    assert is_ply(data)
    mesh = parse_ply(data, "m.ply")
    assert np.array_equal(mesh.vertices, np.array(POINTS, dtype=np.float64))
    assert mesh.faces.tolist() == [[0, 1, 2], [3, 2, 1], [3, 1, 0]]
    assert mesh.face_source.tolist() == [0, 1, 1]
    assert mesh.polygons == 2
    assert (mesh.vertices.dtype, mesh.faces.dtype, mesh.face_source.dtype) == (np.float64, np.int64, np.int64)


def test_rows_may_start_with_the_byte_of_a_line_end():
    data = binary("<", HEADER.replace("\n", "\r"))
    start = data.index(b"end_header\r") + len("end_header\r")
    rows = bytes([10]) + data[start + 1 :]
    assert parse_ply(data[:start] + rows, "m.ply").vertices[0, 0] == struct.unpack("<f", rows[:4])[0]


def test_doubles_keep_every_bit():
    text = TEXT.replace("float", "double").replace("1 1 0", "0.30000000000000004 1e-320 -1e300")
    assert parse_ply(text.encode(), "m.ply").vertices[2].tolist() == [0.30000000000000004, 1e-320, -1e300]


@pytest.mark.parametrize("data", [b"", b"pl", b"plyx\n", b" ply\n", b"PLY\n", b"v 0 0 0\nply\n"])
def test_other_content_is_no_ply(data):
    assert not is_ply(data)


@pytest.mark.parametrize(
    ("old", "new", "code", "place", "message"),
    [
        (TEXT, "ply", "truncated", "m.ply:1", "a PLY header ends with end_header, but the file ends before"),
        (TEXT, TEXT[:59], "truncated", "m.ply:4", "the file ends before"),
        ("format ascii 1.0\n", "", "bad-line", "m.ply:3", "starts with its format, but it has 'element vertex 4'"),
        ("1.0\n", "1.0 extra\n", "bad-line", "m.ply:2", "it has 'format ascii 1.0 extra'"),
        (
            "1.0",
            "2.0",
            "unsupported-format",
            "m.ply:2",
            "a PLY is ascii or binary, 1.0, but it has 'format ascii 2.0'",
        ),
        ("ascii", "binary", "unsupported-format", "m.ply:2", "it has 'format binary 1.0'"),
        ("vertex 4", "vertex +4", "bad-number", "m.ply:4", "an element has a count, but the line has '+4'"),
        ("vertex 4", "vertex -4", "bad-number", "m.ply:4", "the line has '-4'"),
        ("vertex 4", "vertex " + "9" * 5000, "bad-number", "m.ply:4", "the line has '9999"),
        (
            "element face",
            "element vertex",
            "bad-line",
            "m.ply:8",
            "elements, each once, and their properties, but it has",
        ),
        ("element vertex 4\n", "", "bad-line", "m.ply:4", "it has 'property float x'"),
        ("float x", "float128 x", "bad-line", "m.ply:5", "it has 'property float128 x'"),
        ("uchar int", "float int", "bad-line", "m.ply:9", "it has 'property list float int vertex_indices'"),
        ("property float z", "heh", "bad-line", "m.ply:7", "it has 'heh'"),
        ("vertex 4", "point 4", "no-vertices", "m.ply", "a mesh has vertices"),
        ("vertex 4", "vertex 0", "no-vertices", "m.ply", "a mesh has vertices"),
        ("face 2", "faces 2", "no-faces", "m.ply", "only vertices (4)"),
        ("face 2", "tristrips 2", "unsupported-format", "m.ply", "polygons, but this one has triangle strips"),
        ("float z", "float w", "bad-line", "m.ply", "x, y and z of vertices and an integer list vertex_indices"),
        ("property float z", "property list uchar float z", "bad-line", "m.ply", "the header lacks one of them"),
        ("int vertex_indices", "float vertex_indices", "bad-line", "m.ply", "the header lacks one of them"),
        ("vertex_indices", "corners", "bad-line", "m.ply", "the header lacks one of them"),
        (
            "end_header",
            "element edge 1\nend_header",
            "bad-line",
            "m.ply",
            "with rows has properties, but 'edge' has none",
        ),
        (
            "float z\n",
            "float z\nproperty float z\n",
            "bad-line",
            "m.ply",
            "one property each, but vertex has z 2 times",
        ),
        ("float z\n", "float z\nproperty float h\xf6he\n", "bad-line", "m.ply", "names in a PLY header are ASCII"),
        (
            "vertex 4",
            "vertex 999999999999",
            "truncated",
            "m.ply",
            "take 5999999999998 bytes or more, but 42 follow it",
        ),
        (
            "face 2",
            "face 4",
            "truncated",
            "m.ply",
            "the rows that the header promises have a line each (8), but 6 follow it",
        ),
        ("face 2", "face 1", "extra-data", "m.ply:16", "have a line each (5), but 6 follow it"),
        (
            "\n4 3 2 1 0",
            "\n4 3 2 1",
            "bad-line",
            "m.ply:16",
            "a row of face has the numbers that the header says, but this one ends before vertex_indices is complete",
        ),
        (
            "\n4 3 2 1 0",
            "\n4 3 2 1 0 9",
            "bad-line",
            "m.ply:16",
            "a row of face has the numbers that the header says, but this one goes on with '9'",
        ),
        ("\n1 1 0", "\n1 1", "bad-line", "m.ply:13", "this one ends before z is complete"),
        ("\n1 1 0", "\n1 x 0", "bad-number", "m.ply:13", "y of vertex has numbers of the type float, but y has 'x'"),
        ("\n1 1 0", "\n1 1_0 0", "bad-number", "m.ply:13", "a row is made of numbers, but this one is '1 1_0 0'"),
        ("\n1 1 0", "\n1 \u0661 0", "bad-number", "m.ply:13", "a row is made of numbers"),
        ("\n1 1 0", "\n1 1 0#", "bad-number", "m.ply:13", "z has '0#'"),
        ("\n1 1 0", "\n1 1-1 0", "bad-number", "m.ply:13", "y has '1-1'"),
        ("\n1 1 0", "\n1 nan(1) 0", "bad-number", "m.ply:13", "y has 'nan(1)'"),
        ("\n1 1 0", "\n1 1 " + "x" * 99, "bad-number", "m.ply:13", "z has 'xxxxxxxxxxxxxxx"),
        ("\n1 1 0\n", "\n\n1 1 0 ", "bad-line", "m.ply:13", "this one ends before x is complete"),
        ("\n1 1 0", "\n1 nan 0", "not-finite", "m.ply:13", "y of vertex 3 is nan"),
        ("\n1 1 0", "\n1 1e99 0", "not-finite", "m.ply:13", "y of vertex 3 is inf"),
        ("\n1 1 0", "\n1 1\x0b0", "bad-encoding", "m.ply:13", "it has byte 0x0b"),
        ("\n3 0 1 2", "\n2 0 1", "bad-face", "m.ply:15", "a face has at least three corners, but face 1 has 2"),
        ("\n3 0 1 2", "\n0", "bad-face", "m.ply:15", "face 1 has 0"),
        ("\n3 0 1 2", "\n3 0 1 4", "index-out-of-range", "m.ply:15", "less one (3), but face 1 has index 4"),
        ("\n3 0 1 2", "\n3 0 1 -1", "index-out-of-range", "m.ply:15", "face 1 has index -1"),
        (
            "\n3 0 1 2",
            "\n3 0 1 2.5",
            "index-out-of-range",
            "m.ply:15",
            "a whole number from 0 to 3, but vertex_indices has '2.5'",
        ),
        ("\n3 0 1 2", "\n3 0 1 2#5", "index-out-of-range", "m.ply:15", "vertex_indices has '2#5'"),
        ("\n3 0 1 2", "\n3 0 1 2147483648", "index-out-of-range", "m.ply:15", "vertex_indices has '2147483648'"),
        ("\n3 0 1 2", "\n-1 0 1 2", "bad-number", "m.ply:15", "numbers of the type uint8, but this row has '-1'"),
        ("\n3 0 1 2", "\n300 0 1 2", "bad-number", "m.ply:15", "numbers of the type uint8, but this row has '300'"),
    ],
)
def test_refusals_of_text(old, new, code, place, message):
    assert old in TEXT
    error = refused(TEXT.replace(old, new, 1))
    assert (error.code, error.place) == (code, place)
    assert message in str(error)
    assert error.advice


@pytest.mark.parametrize(
    ("data", "code", "message"),
    [
        (binary()[:-1], "truncated", "the rows of face are what the header says, but the file ends in row 2 of 2"),
        (binary()[:-20], "truncated", "the file ends in row 1 of 2"),
        (binary()[:-40], "truncated", "the rows that the header promises take 50 bytes or more, but 38 follow it"),
        (binary() + b"\n", "extra-data", "the file ends with its last row, but 1 bytes follow"),
        (
            binary(header=HEADER.replace("vertex 4", "vertex 999999999999")),
            "truncated",
            "11999999999990 bytes or more",
        ),
        (binary().replace(struct.pack("<f", 1), struct.pack("<f", np.inf), 1), "not-finite", "x of vertex 2 is inf"),
        (binary().replace(struct.pack("<f", 1), b"\x01\x00\x80\x7f", 1), "not-finite", "x of vertex 2 is nan"),
        (binary()[:-4] + struct.pack("<i", 4), "index-out-of-range", "less one (3), but face 2 has index 4"),
        (binary()[:-4] + struct.pack("<i", -1), "index-out-of-range", "face 2 has index -1"),
    ],
)
def test_refusals_of_binary(data, code, message):
    error = refused(data)
    assert (error.code, error.place) == (code, "m.ply")
    assert message in str(error)
    assert error.advice


@pytest.mark.parametrize("promised", ["vertex 999999999", "face 999999999"])
@pytest.mark.parametrize("data", [TEXT.encode(), binary()])
def test_promises_take_no_memory(data, promised):
    lying = data.replace(b"vertex 4" if "vertex" in promised else b"face 2", promised.encode())
    tracemalloc.start()
    try:
        assert refused(lying).code == "truncated"
        assert tracemalloc.get_traced_memory()[1] < 1_000_000
    finally:
        tracemalloc.stop()


def test_list_that_promises_too_much_takes_no_memory():
    header = HEADER.replace("list uchar", "list uint")
    body = binary()[len(HEADER.format(format="binary_little_endian")) :][:48] + struct.pack(
        "<2I", 2**32 - 1, 2**32 - 1
    )
    assert refused(header.format(format="binary_little_endian").encode() + body).code == "truncated"


@pytest.mark.parametrize("order", "<>")
@pytest.mark.parametrize("length_type", ["char", "short", "int", "int8", "int16", "int32"])
def test_a_list_of_negative_length_is_refused(order, length_type):
    # some readers take the rest of the file for a list of length -1, and all of it would be one face
    header = HEADER.replace("list uchar", f"list {length_type}").replace("face 2", "face 1")
    format_name = {"<": "binary_little_endian", ">": "binary_big_endian"}[order]
    points = b"".join(struct.pack(f"{order}3f", *point) for point in POINTS)
    size = {"char": 1, "int8": 1, "short": 2, "int16": 2, "int": 4, "int32": 4}[length_type]
    unsigned = 256**size - 1
    for corners in (3, 255, 70_000):
        body = (
            points
            + b"\xff" * size
            + struct.pack(f"{order}{corners}i", *[0, 1, 2, 3] * (corners // 4), *range(corners % 4))
        )
        error = refused(header.format(format=format_name).encode() + body)
        assert error.code == (
            "bad-face" if corners == unsigned else "truncated" if corners < unsigned else "extra-data"
        )
