import numpy as np
import pytest

from meshshard.errors import InvalidMesh
from meshshard_prep.formats.off import is_off, parse_off

VERTICES = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n"
CORNERS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], dtype=np.float64)
SQUARE = f"OFF\n4 2 0\n{VERTICES}3 0 1 2\n3 2 3 0\n"


def refused(text):
    with pytest.raises(InvalidMesh) as caught:
        parse_off(text.encode(), "m.off")
    return caught.value


@pytest.mark.parametrize(
    "text",
    [
        SQUARE,
        SQUARE.replace("\n", "\r\n"),
        SQUARE.replace("\n", "\r"),
        SQUARE.rstrip(),
        SQUARE.replace("OFF\n4 2 0", "OFF 4 2 0"),
        SQUARE.replace("OFF\n4 2 0", "OFF4 2 0"),
        SQUARE.replace("4 2 0", "4 2"),
        SQUARE.replace("4 2 0", "4 2 999999"),
        SQUARE.replace("\n", "  # a comment\n\n # OFF 3 3\n"),
        "# first\n#second OFF\n\n  " + SQUARE,
        SQUARE.replace("OFF", "OFF#glued"),
        SQUARE.replace("OFF", "COFF").replace(" 0\n", " 0 255 0 0 255\n").replace("4 2 0 255 0 0 255", "4 2 0"),
        SQUARE.replace("OFF", "NOFF").replace("0\n", "0 0 0 1\n").replace("4 2 0 0 0 1", "4 2 0"),
        *(SQUARE.replace("OFF", keyword) for keyword in ("CNOFF", "NCOFF", "STOFF", "STCNOFF")),
        SQUARE.replace("3 0 1 2\n3 2 3 0", "3 0 1 2  0.5 0.5 1 1\n3  2 3 0 7"),
    ],
)
def test_variants_of_one_mesh(text):
    mesh = parse_off(text.encode(), "m.off")
    assert np.array_equal(mesh.vertices, CORNERS)
    assert mesh.faces.tolist() == [[0, 1, 2], [2, 3, 0]]
    assert mesh.face_source.tolist() == [0, 1]
    assert mesh.polygons == 2
    assert (mesh.vertices.dtype, mesh.faces.dtype, mesh.face_source.dtype) == (np.float64, np.int64, np.int64)


def test_polygons_are_fans_from_their_first_corner():
    mesh = parse_off(f"OFF 5 3 0\n{VERTICES}9 9 9\n3 0 1 2\n5 1 2 3 4 0\n4 3 2 1 0 255 0 0\n".encode(), "m.off")
    assert mesh.faces.tolist() == [[0, 1, 2], [1, 2, 3], [1, 3, 4], [1, 4, 0], [3, 2, 1], [3, 1, 0]]
    assert mesh.face_source.tolist() == [0, 1, 1, 1, 2, 2]
    assert mesh.polygons == 3


def test_repeated_indices_are_kept():
    assert parse_off(SQUARE.replace("3 2 3 0", "3 2 2 0").encode(), "m.off").faces.tolist() == [[0, 1, 2], [2, 2, 0]]


@pytest.mark.parametrize(
    "text", ["OFFICE", "off\n4 2 0", "v 0 0 0\nOFF", "# OFF", "OF", "", "ply", "DOFF", "OFF-4 2 0"]
)
def test_other_content_is_no_off(text):
    assert not is_off(text.encode())


def test_first_word_is_found_in_no_time():
    assert not is_off(b"# " * 200_000)
    assert not is_off(b"#\n" * 200_000)
    assert not is_off(b"STCN" * 100_000)


@pytest.mark.parametrize(
    ("text", "code", "place", "message"),
    [
        ("OFF BINARY\n4 2 0\n", "unsupported-format", "m.off", "text in 3 dimensions, but this one is binary"),
        ("COFF  BINARY", "unsupported-format", "m.off", "binary"),
        ("4OFF\n4 2 0\n", "unsupported-format", "m.off", "this one is of another dimension"),
        ("nOFF\n5\n4 2 0\n", "unsupported-format", "m.off", "another dimension"),
        ("OFF\n", "truncated", "m.off", "followed by the counts of vertices, faces and edges, but the file ends"),
        ("OFF\n4\n", "bad-line", "m.off:2", "but the line has 1 columns"),
        ("OFF\n4 2 0 0\n", "bad-line", "m.off:2", "but the line has 4 columns"),
        ("OFF\n4 -2 0\n", "bad-number", "m.off:2", "but the line is '4 -2 0'"),
        ("OFF\n4 2.0 0\n", "bad-number", "m.off:2", "but the line is '4 2.0 0'"),
        ("OFF\n4 \u0662 0\n", "bad-number", "m.off:2", "but the line is"),
        ("OFF " + "9" * 5000 + " 2 0\n", "bad-number", "m.off:1", "but the line is '9999"),
        ("OFF 0 0 0\n", "no-vertices", "m.off", "a mesh has vertices"),
        ("OFF 1 0 0\n0 0 0\n", "no-faces", "m.off", "only vertices (1)"),
        (
            SQUARE.replace("4 2", "353535235358 2"),
            "truncated",
            "m.off",
            "the header's 353535235358 vertices and 2 faces have a line each (353535235360), but 6 follow",
        ),
        (
            SQUARE.replace("4 2", "4 3"),
            "truncated",
            "m.off",
            "4 vertices and 3 faces have a line each (7), but 6 follow",
        ),
        (SQUARE + "\n3 0 1 3\n", "extra-data", "m.off:10", "2 faces have a line each (6), but 7 follow"),
        (SQUARE.replace("1 1 0", "1 1"), "bad-line", "m.off:5", "a vertex has three coordinates, but the line has 2"),
        (
            SQUARE.replace("1 1 0", "1 1 0 red"),
            "bad-line",
            "m.off:5",
            "extra columns are numbers, but the line goes on with 'red'",
        ),
        (
            SQUARE.replace("1 1 0", "1 1 O"),
            "bad-number",
            "m.off:5",
            "a coordinate is a decimal number, but the line has 'O'",
        ),
        (SQUARE.replace("1 1 0", "1 1.#IND 0"), "bad-number", "m.off:5", "the line has '1.#IND'"),
        (SQUARE.replace("1 1 0", "1 inf 0"), "not-finite", "m.off:5", "y of vertex 3 is inf"),
        (
            SQUARE.replace("3 0 1 2", "2 0 1"),
            "bad-face",
            "m.off:7",
            "a face has at least three corners, but face 1 has 2",
        ),
        (SQUARE.replace("3 2 3 0", "-3 2 3 0"), "bad-face", "m.off:8", "face 2 has -3"),
        (
            SQUARE.replace("3 0 1 2", "3: 0 1 2"),
            "bad-face",
            "m.off:7",
            "starts with its number of corners, but it has '3:'",
        ),
        (
            SQUARE.replace("3 0 1 2", "4 0 1 2"),
            "bad-face",
            "m.off:7",
            "as many corners as it says (4), but there are 3",
        ),
        (
            SQUARE.replace("3 2 3 0", "3 2 3"),
            "truncated",
            "m.off:8",
            "as many corners as it says (3), but there are 2",
        ),
        (
            SQUARE.replace("3 2 3 0", "9" * 30 + " 2 3"),
            "truncated",
            "m.off:8",
            "(999999999999999999999999999999), but",
        ),
        (
            SQUARE.replace("3 2 3 0", "3 2 3 0.0"),
            "bad-face",
            "m.off:8",
            "a corner is an integer, but the face has '0.0'",
        ),
        (SQUARE.replace("3 2 3 0", "3 2 3 0 x"), "bad-line", "m.off:8", "the line goes on with 'x'"),
        (
            SQUARE.replace("3 2 3 0", "3 2 3 4"),
            "index-out-of-range",
            "m.off:8",
            "less one (3), but face 2 has index 4",
        ),
        (SQUARE.replace("3 2 3 0", "3 2 3 -1"), "index-out-of-range", "m.off:8", "face 2 has index -1"),
        ("OFF 3 1 0\n" + "9" * 40, "truncated", "m.off", "but 1 follow"),
    ],
)
def test_refusals(text, code, place, message):
    error = refused(text)
    assert (error.code, error.place) == (code, place)
    assert message in str(error)
    assert error.advice
