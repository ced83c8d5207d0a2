"""Rows are read as the package plyfile reads them, or refused."""

import random
import time
from itertools import pairwise

import numpy as np
import pytest
from effort import times
from ply_files import INTEGERS, LETTERS, ORDERS, any_file, any_value, native, ply_file, plyfile_columns
from polygons import POLYGONS
from shapes import grid

from meshshard.errors import InvalidMesh
from meshshard_prep.formats.ply import parse_ply, read_rows
from meshshard_prep.formats.ply_columns import Lists
from meshshard_prep.formats.ply_header import read_header

XYZ = [("", "float", axis) for axis in "xyz"]
CORNERS = [("uchar", "int", "vertex_index")]
TEXT = [*b" |\n|-|+|.|e|9|0|nan|inf|99999999999|#|x|\t|256| 3 |1.0|-0|1e400|nan(1)|0x1|1_0|--|Infinity|".split(b"|")]
"""What a damaged text gets somewhere; the last is nothing."""


def columns(data):
    """Element -> type and bytes of each column; or the code of a refusal."""
    try:
        header = read_header(data, "m")
        found = read_rows(data, header, "m")
    except InvalidMesh as error:
        return error.code
    return {
        name: [(c.lengths.tolist(), native(c.values)) if isinstance(c, Lists) else native(c) for c in of_element]
        for name, of_element in found.items()
    }


def assert_equal_to_plyfile(data):
    found = columns(data)
    assert isinstance(found, dict), found
    assert found == plyfile_columns(data, read_header(data, "m"))


@pytest.mark.parametrize("form", ORDERS)
@pytest.mark.parametrize("name", POLYGONS)
def test_shapes(name, form):
    vertices, faces = POLYGONS[name]
    properties = [("uchar", "int", "vertex_indices"), ("", "uchar", "red"), ("uchar", "double", "uv")]
    rows = [[face, 7, [0.1, -1.5]] for face in faces]
    data = ply_file(form, [("vertex", XYZ, vertices.tolist()), ("face", properties, rows)])
    assert_equal_to_plyfile(data)
    mesh = parse_ply(data, "m")
    np.testing.assert_array_equal(mesh.vertices, vertices.astype("f4"))
    fans = [[face[0], b, c] for face in faces for b, c in pairwise(face[1:])]
    assert mesh.faces.tolist() == fans


@pytest.mark.parametrize("form", ORDERS)
@pytest.mark.parametrize("kind", LETTERS)
def test_every_type_alone_and_in_lists(kind, form):
    rng = random.Random(kind)
    properties = [("", kind, "a"), *((length, kind, "list") for length in INTEGERS), ("", kind, "b")]

    def value(is_list, count):
        return [any_value(rng, kind) for _ in range(count)] if is_list else any_value(rng, kind)

    for uneven in (False, True):
        rows = [[value(p[0], rng.randint(0, 9) if uneven else 3) for p in properties] for _ in range(20)]
        assert_equal_to_plyfile(ply_file(form, [("none", properties, []), ("some", properties, rows)]))


def test_numbers_in_text_are_rounded_as_python_rounds_them():
    rng = random.Random(0)
    words = [repr(rng.uniform(-1, 1) * 10.0 ** rng.randint(-320, 308)) for _ in range(times(2000, 200_000))]
    words += [word[: rng.randint(3, 12)].rstrip("e-+") for word in words]
    words += ["1.", ".5", "+5", "1E5", "007", "1e-400", "1e400"]
    data = ply_file("ascii", [("vertex", [("", "double", "x")], [[0]] * len(words))])
    data = data[: data.index(b"end_header\n") + 11] + "\n".join(words).encode()
    (read,) = read_rows(data, read_header(data, "m"), "m")["vertex"]
    np.testing.assert_array_equal(read, [float(word) for word in words])


@pytest.mark.parametrize("lengths", [[3, 3, 3], [2, 4], [4, 2], [1, 5, 0, 6], [70_000], [0, 0]])
@pytest.mark.parametrize("form", ORDERS)
def test_rows_of_one_size_with_lists_of_several_lengths(form, lengths):
    lists = [("uint", "short", "a"), ("", "char", "between"), ("uint", "short", "b")]
    rows = [[[1] * length, 7, [2] * (max(lengths) - length)] for length in lengths]
    assert_equal_to_plyfile(ply_file(form, [("note", lists, rows), ("end", [("", "uchar", "e")], [[1], [2]])]))


@pytest.mark.soak
def test_any_file_is_read_alike_and_any_damage_read_alike_or_refused(measured):
    rng = random.Random(5)
    read = refused = 0
    for number in range(times(400, 5000)):
        whole = any_file(rng)
        start = read_header(whole, "m").end
        assert_equal_to_plyfile(whole)
        for _ in range(4):
            data, pool = bytearray(whole), TEXT if b"ascii" in whole[:20] else [b"", b"\xff", b"\0", rng.randbytes(2)]
            for _ in range(rng.choice([1, 1, 2])):
                at = rng.randrange(start, len(whole))
                data[at : at + rng.randrange(3)] = rng.choice(pool)
            data = bytes(data)
            found, theirs = columns(data), plyfile_columns(data, read_header(data, "m"))
            if isinstance(found, dict):
                assert found == theirs, (number, data)
                read += 1
            else:  # plyfile overlooks further lines, and reads 1_0 as 10, and 1#0 in a list as 1
                assert theirs is None or found == "extra-data" or b"_" in data or b"#" in data, (number, found, data)
                refused += 1
    assert min(read, refused) > number / 2
    measured("R1", f"PLY: {read + refused} damaged files = {read} read as plyfile reads them + {refused} refused")


@pytest.mark.parametrize("form", ORDERS)
def test_a_file_that_ends_early_is_refused_at_every_byte(form):
    elements = [("vertex", XYZ, [[0, 0, 0]] * 3), ("face", CORNERS, [[[0, 1, 2]], [[2, 1, 0, 1]]])]
    whole = ply_file(form, elements)
    for end in range(4, len(whole) - 2):
        assert isinstance(columns(whole[:end]), str), end


def test_a_million_faces_take_seconds():
    """0.5 s for the faces of a binary file, where triangles and quads take turns, on a quiet core."""
    vertices, _ = grid(10, 10)
    faces = [[[0, 1, 2]], [[0, 1, 3, 2]]] * 500
    whole = ply_file("binary_little_endian", [("vertex", XYZ, vertices.tolist()), ("face", CORNERS, faces)])
    rows = len(faces) // 2 * (1 + 3 * 4 + 1 + 4 * 4)
    data = whole.replace(b"face 1000\n", b"face 1000000\n") + whole[-rows:] * 999
    started = time.process_time()
    assert parse_ply(data, "m").polygons == 1_000_000
    assert time.process_time() - started < 10
