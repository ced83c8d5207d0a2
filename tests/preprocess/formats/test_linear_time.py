"""Files made to be slow to read: the time grows as their size, whatever is in them."""

import struct
import time
from contextlib import nullcontext, suppress

import numpy as np
import pytest

from meshshard.errors import InvalidMesh
from meshshard.recipe import RECIPES
from meshshard_prep.formats import parse_mesh
from meshshard_prep.pipeline import features_of

POINTS = b"v 0 0 0\nv 1 0 0\nv 0 1 0\n"
FACE = b"f 1 2 3\n"
OFF = b"OFF\n3 %d 0\n0 0 0\n1 0 0\n0 1 0\n"
VERTEX = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
FACES = "element face 1\nproperty list uchar int vertex_indices\n"
ROWS = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0)
ONE = b"\3" + struct.pack("<3i", 0, 1, 2)


def ply(header, body, form="binary_little_endian"):
    return f"ply\nformat {form} 1.0\n{header}end_header\n".encode() + body


TRAPS = {
    "blanks": lambda n: POINTS + b" " * n + b"\n" + FACE,
    "blanks and comment signs": lambda n: b" \t#" * (n // 3) + b"\n" + POINTS + FACE,
    "comment of blanks": lambda n: POINTS + b"#" + b" " * n + b"x\n" + FACE,
    "comment signs": lambda n: POINTS + b"#" * n + b"\n" + FACE,
    "points and comment signs": lambda n: POINTS + b".#" * (n // 2) + b"\n" + FACE,
    "empty comments": lambda n: b"#\n" * (n // 2) + POINTS + FACE,
    "promises": lambda n: b"# Vertices: 1\n" * (n // 14) + POINTS + FACE,
    "broken promises": lambda n: b"# Vertices:" + b" " * n + b"1" * 30 + b"\n" + POINTS + FACE,
    "backslashes": lambda n: POINTS + b"\\" * n + b"\n" + FACE,
    "backslashes and blanks": lambda n: POINTS + b"\\ " * (n // 2) + b"x\n" + FACE,
    "one backslash and blanks": lambda n: POINTS + b"\\" + b" " * n + b"x\n" + FACE,
    "continued lines": lambda n: b"\\\n" * (n // 2) + b"\n" + POINTS + FACE,
    "a continued face": lambda n: POINTS + b"f" + b" 1\\\n" * (n // 4) + b"\n",
    "carriage returns": lambda n: POINTS + b"\r" * n + FACE,
    "a long number": lambda n: b"v 0." + b"1" * n + b" 0 0\n" + POINTS + FACE,
    "a long exponent": lambda n: b"v 1e" + b"1" * n + b" 0 0\n" + POINTS + FACE,
    "a long index": lambda n: POINTS + b"f " + b"9" * n + b" 1 1\n",
    "slashes": lambda n: POINTS + b"f " + b"/" * n + b" 1 1\n",
    "a large face": lambda n: POINTS + b"f " + b"1 2 3 " * (n // 6) + b"\n",
    "a bad last corner": lambda n: POINTS + b"f " + b"1/1 " * (n // 4) + b"x\n",
    "a bad last line": lambda n: POINTS + FACE * (n // 8) + b"f x 1 1\n",
    "a bad last byte": lambda n: POINTS + b"#" * n + b"\xff",
    "OFF after blanks": lambda n: b" " * n + OFF % 1 + b"3 0 1 2\n",
    "OFF prefixes": lambda n: b"ST" * (n // 2) + b"OFX",
    "OFF columns": lambda n: OFF % 1 + b"3 0 1 2 " + b"1 " * (n // 2) + b"x\n",
    "OFF large face": lambda n: OFF % 1 + b"%d " % (n // 2) + b"1 " * (n // 2) + b"\n",
    "OFF bad sizes": lambda n: OFF % (n // 2) + b"x\n" * (n // 2),
    "PLY comments": lambda n: ply("comment x\n" * (n // 10) + VERTEX + FACES, ROWS + ONE),
    "PLY properties": lambda n: ply(
        VERTEX + "".join(f"property char p{i}\n" for i in range(n // 18)) + FACES, ROWS + b"\0" * (n // 6) + ONE
    ),
    "PLY lists": lambda n: ply(
        VERTEX + FACES + "".join(f"property list char char p{i}\n" for i in range(n // 28)),
        ROWS + ONE + b"\0" * (n // 28),
    ),
    "PLY elements": lambda n: ply(VERTEX + "".join(f"element e{i} 0\n" for i in range(n // 16)) + FACES, ROWS + ONE),
    "PLY large face": lambda n: ply(
        VERTEX + FACES.replace("uchar int", "uint uchar"), ROWS + struct.pack("<I", n) + b"\1" * n
    ),
    "PLY empty faces": lambda n: ply(VERTEX + FACES.replace("face 1", f"face {n}"), ROWS + b"\0" * n),
    "PLY bad rows": lambda n: ply(
        VERTEX + FACES.replace("face 1", f"face {n // 2}"), b"0 0 0\n" * 3 + b"x\n" * (n // 2), "ascii"
    ),
}


def seconds(data):
    """The shorter of two times, for other programs run too."""
    found = []
    for _ in range(2):
        start = time.perf_counter()
        with suppress(InvalidMesh):
            parse_mesh(data, "m")
        found.append(time.perf_counter() - start)
    return min(found)


@pytest.mark.parametrize("name", TRAPS)
def test_sixteen_times_the_file_takes_about_sixteen_times_as_long(name):
    small, large = TRAPS[name](10_000), TRAPS[name](160_000)
    assert len(large) > 10 * len(small)
    assert seconds(large) < 80 * max(seconds(small), 1e-3)  # squares would make it 256


@pytest.mark.parametrize("vertices", [7, 30_000])
def test_a_face_of_very_many_corners_holds_nobody_up(vertices):
    angle = 2 * np.pi * np.arange(vertices) / vertices
    lines = [f"v {x:.6f} {y:.6f} 0" for x, y in zip(np.cos(angle), np.sin(angle), strict=True)]
    data = "\n".join([*lines, "f " + " ".join(map(str, np.resize(np.arange(1, vertices + 1), 300_000))), ""]).encode()
    start = time.perf_counter()
    with pytest.raises(InvalidMesh, match="crowded-edge") if vertices == 7 else nullcontext():
        assert len(features_of(parse_mesh(data, "m"), RECIPES["paper"]).faces) == 299_998
    assert time.perf_counter() - start < 60  # typical are 0.2 and 6


@pytest.mark.parametrize("corners", [300, 30_000])
def test_a_round_face_of_many_corners_is_welcome(corners):
    angle = 2 * np.pi * np.arange(corners) / corners
    lines = [f"v {x!r} {y!r} 0" for x, y in zip(np.cos(angle).tolist(), np.sin(angle).tolist(), strict=True)]
    data = "\n".join([*lines, "f " + " ".join(map(str, range(1, corners + 1))), ""]).encode()
    sample = features_of(parse_mesh(data, "m"), RECIPES["paper"])
    assert len(sample.faces) == corners - 2
    assert sample.diagnostics["boundary_edges"] == corners
