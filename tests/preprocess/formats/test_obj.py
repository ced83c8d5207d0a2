import numpy as np
import pytest

from meshshard.errors import InvalidMesh
from meshshard_prep.formats.obj import parse_obj

SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
CORNERS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], dtype=np.float64)


def faces(text):
    return parse_obj(text.encode(), "m.obj").faces.tolist()


def refused(text):
    with pytest.raises(InvalidMesh) as caught:
        parse_obj(text.encode(), "m.obj")
    return caught.value


def test_plain_file_in_file_order():
    mesh = parse_obj((SQUARE + "f 1 2 3\nf 3 4 1\n").encode(), "m.obj")
    assert np.array_equal(mesh.vertices, CORNERS)
    assert mesh.faces.tolist() == [[0, 1, 2], [2, 3, 0]]
    assert mesh.face_source.tolist() == [0, 1]
    assert mesh.polygons == 2
    assert (mesh.vertices.dtype, mesh.faces.dtype, mesh.face_source.dtype) == (np.float64, np.int64, np.int64)


def test_numbers_keep_every_bit():
    numbers = ["0.1", "-1e-3", "+2.", ".5", "1E5", "0.30000000000000004", "1e-320", "-0", "3.1e+02"]
    mesh = parse_obj(
        (" ".join(["v", *numbers[:3], "\nv", *numbers[3:6], "\nv", *numbers[6:], "\nf 1 2 3\n"])).encode(), ""
    )
    assert mesh.vertices.ravel().tolist() == [float(number) for number in numbers]


@pytest.mark.parametrize("line_end", ["\n", "\r\n", "\r"])
def test_line_ends(line_end):
    assert faces((SQUARE + "f 1 2 3\nf 3 4 1\n").replace("\n", line_end)) == [[0, 1, 2], [2, 3, 0]]


@pytest.mark.parametrize(
    "corners", ["1 2 3", "1/9 2/9 3/9", "1//7 2//7 3//7", "1/9/7 2/9/7 3/9/7", "1/ 2// 3/9/", "+1 +2 +3"]
)
def test_texture_and_normal_indices_are_left_out(corners):
    assert faces(SQUARE + f"f {corners}\n") == [[0, 1, 2]]


def test_negative_indices_count_back_from_the_face():
    first, second = "v 0 0 0\nv 1 0 0\nv 1 1 0\n", "v 0 0 1\nv 1 0 1\nv 1 1 1\n"
    assert faces(first + "f -3 -2 -1\n" + second + "f -3/1 -2/1 -1/1\nf 1 -1 4\n") == [
        [0, 1, 2],
        [3, 4, 5],
        [0, 5, 3],
    ]


def test_faces_may_come_before_their_vertices():
    assert faces("f 1 2 3\n" + SQUARE) == [[0, 1, 2]]


def test_polygons_are_fans_from_their_first_corner():
    mesh = parse_obj((SQUARE + "v 2 2 2\nf 1 2 3\nf 2 3 4 5 1\nf 4 3 2 1\n").encode(), "m.obj")
    assert mesh.faces.tolist() == [[0, 1, 2], [1, 2, 3], [1, 3, 4], [1, 4, 0], [3, 2, 1], [3, 1, 0]]
    assert mesh.face_source.tolist() == [0, 1, 1, 1, 2, 2]
    assert mesh.polygons == 3


def test_repeated_indices_and_unused_vertices_are_kept():
    mesh = parse_obj((SQUARE + "f 1 1 2\nf 3 3 3\n").encode(), "m.obj")
    assert mesh.faces.tolist() == [[0, 0, 1], [2, 2, 2]]
    assert len(mesh.vertices) == 4


@pytest.mark.parametrize("extra", ["1.0", "0.5 0.25 1", "0.5 0.25 1 1", "# comment", "#comment", "nan"])
def test_columns_after_the_third_are_left_out(extra):
    mesh = parse_obj(SQUARE.replace("\n", f" {extra}\n").encode() + b"f 1 2 3\n", "m.obj")
    assert np.array_equal(mesh.vertices, CORNERS)


def test_comments_blanks_and_other_statements():
    text = "# a file\n\n  # indented\nmtllib a b.mtl\no #1\ng a f v\n" + SQUARE
    text += "vt 0 0\nvn 0 0 1\nusemtl x\ns off\n\tf 1 2 3#c:\\\nl 1 2\np 1\nnewmtl y\nKd 1 1 1\n f 3  4\t1 # f 1 2\n"
    assert faces(text) == [[0, 1, 2], [2, 3, 0]]


def test_backslash_continues_a_line():
    assert faces(SQUARE + "f 1 \\\n 2\\\n 3 4\nf 1 2 \\  \n3\n") == [[0, 1, 2], [0, 2, 3], [0, 1, 2]]


def test_line_numbers_stay_right_after_a_continued_line():
    assert refused(SQUARE + "f 1 \\\n 2 \\\n 3\nf 1 2 9\n").place == "m.obj:8"


def test_backslash_that_ends_a_comment_continues_nothing():
    assert faces("# from C:\\\n" + SQUARE + "f 1 2 3\n") == [[0, 1, 2]]


def test_file_without_last_line_end():
    assert faces("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3") == [[0, 1, 2]]


def test_counts_in_comments_may_be_kept():
    assert faces("# Vertices: 4\n#\tFaces:  1\n" + SQUARE + "f 1 2 3\n") == [[0, 1, 2]]
    assert faces("# Vertices: 8\n# Vertices: 9\n" + SQUARE + "f 1 2 3\n") == [[0, 1, 2]]


@pytest.mark.parametrize(
    ("text", "code", "place", "message"),
    [
        ("# nothing\n", "no-vertices", "m.obj", "a mesh has vertices, but the file has none"),
        ("f -3 -2 -1\n", "no-vertices", "m.obj", "the file has none"),
        (SQUARE + "p 1\n", "no-faces", "m.obj", "a mesh has faces, but the file has none, only vertices (4)"),
        (SQUARE + "f 1 2\n", "bad-face", "m.obj:5", "a face has at least three corners, but face 1 has 2"),
        (SQUARE + "f 1 2 3\nf\n", "bad-face", "m.obj:6", "face 2 has 0"),
        (SQUARE + "f 1 2 x\n", "bad-face", "m.obj:5", "i/t, i//n, i/t/n, but the face has 'x'"),
        (SQUARE + "f 1 2 3.0\n", "bad-face", "m.obj:5", "the face has '3.0'"),
        (SQUARE + "f 1 2 3\nf 1 2 1_0\n", "bad-face", "m.obj:6", "the face has '1_0'"),
        (SQUARE + "f 1/1 2/1 /1\n", "bad-face", "m.obj:5", "the face has '/1'"),
        (SQUARE + "f 1/1/1/1 2 3\n", "bad-face", "m.obj:5", "the face has '1/1/1/1'"),
        (
            SQUARE + "f 1 2 " + "3" * 5000 + "\n",
            "bad-face",
            "m.obj:5",
            "the face has '3333333333333333333333333333333333333...'",
        ),
        (
            SQUARE + "f 1 2 5\n",
            "index-out-of-range",
            "m.obj:5",
            "the number of vertices (4), but the face has index 5",
        ),
        (SQUARE + "f 1 2 3\nf 0 1 2\n", "index-out-of-range", "m.obj:6", "lies between 1 and"),
        (SQUARE + "f 1 2 99999999999999999999\n", "index-out-of-range", "m.obj:5", "index 99999999999999999999. "),
        (SQUARE + "f 1/1 2/1 999/1\n", "index-out-of-range", "m.obj:5", "index 999/1"),
        (
            "v 0 0 0\nf -1 -2 1\nv 0 0 0\n",
            "index-out-of-range",
            "m.obj:2",
            "the face has index -2, and 1 are before it",
        ),
        ("v 0 0\n", "bad-line", "m.obj:1", "a vertex has three coordinates, but the line has 2"),
        (SQUARE + "bleh\n", "bad-line", "m.obj:5", "an OBJ statement such as v or f, but this one has 'bleh'"),
        ("v 0 0 0 v 1 0 0\n", "bad-line", "m.obj:1", "extra columns are numbers, but the line goes on with 'v'"),
        (
            SQUARE + "v 0 0,5 0\nf 1 2 3\n",
            "bad-number",
            "m.obj:5",
            "a coordinate is a decimal number, but the line has '0,5'",
        ),
        (SQUARE + "v 0 0 1_0\nf 1 2 3\n", "bad-number", "m.obj:5", "the line has '1_0'"),
        (SQUARE + "v 0 0 \u0663\nf 1 2 3\n", "bad-number", "m.obj:5", "the line has '\u0663'"),
        (SQUARE + "v 0 0 1.#INF\nf 1 2 3\n", "bad-number", "m.obj:5", "the line has '1.#INF'"),
        (
            "v 0 0 0\nv 0 nan 0\nv 0 inf 0\nf 1 2 3\n",
            "not-finite",
            "m.obj:2",
            "every coordinate is finite, but y of vertex 2 is nan",
        ),
        ("v 0 0 0\nv 0 0 -1e999\nv 0 0 0\nf 1 2 3\n", "not-finite", "m.obj:2", "z of vertex 2 is -inf"),
        (
            "# Vertices: 9\n" + SQUARE + "f 1 2 3\n",
            "truncated",
            "m.obj",
            "comment '# Vertices: 9' promises, but it has 4",
        ),
        ("# Faces: 2\n" + SQUARE + "f 1 2 3\n", "truncated", "m.obj", "comment '# Faces: 2' promises, but it has 1"),
        (
            SQUARE + "f 1 2 3",
            "truncated",
            "m.obj:5",
            "uses all its vertices, but it ends in a face and leaves 1 of 4 unused",
        ),
    ],
)
def test_refusals(text, code, place, message):
    error = refused(text)
    assert (error.code, error.place) == (code, place)
    assert message in str(error)
    assert error.advice


@pytest.mark.parametrize(("byte", "line"), [(b"\xff", 2), (b"\0", 2), (b"\x0b", 2), (b"\x1c", 2)])
@pytest.mark.parametrize("line_end", [b"\n", b"\r\n", b"\r"])
def test_bytes_that_no_text_has(byte, line, line_end):
    with pytest.raises(InvalidMesh, match=f"the text is UTF-8, but it has byte 0x{byte.hex()}") as caught:
        parse_obj(b"v 0 0 0" + line_end + b"v 1" + byte + b" 0 0", "m.obj")
    assert (caught.value.code, caught.value.place) == ("bad-encoding", f"m.obj:{line}")


def test_long_runs_of_backslashes_take_no_time():
    assert refused("\\ " * 200_000).code == "bad-line"
    assert faces(SQUARE + "f 1 2 3" + " \\\n" * 100_000 + "\n") == [[0, 1, 2]]
