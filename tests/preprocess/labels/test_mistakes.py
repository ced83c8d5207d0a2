"""Mistakes in label files are told with their line; nothing that is read ends in anything else."""

import contextlib
import io
import random
from pathlib import Path

import numpy as np
import pytest
from polygons import obj_text
from shapes import box

from meshshard.errors import InvalidMesh
from meshshard_prep.formats import parse_mesh
from meshshard_prep.labels import FORMS, LabelFile, Written, offered, read_labels

BOX = parse_mesh(obj_text(*box()).encode(), "box")


def npy(array):
    stream = io.BytesIO()
    np.save(stream, array)
    return stream.getvalue()


def ply(rows, kind="int"):
    header = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    header += f"property {kind} label\nproperty list uchar int near\nelement face 1\n"
    header += "property list uchar int vertex_indices\nend_header\n"
    return (header + rows).encode()


MISTAKES = [
    ("json", b"[1,\n2,\nx]", r"x:3: the file is JSON, but Expecting value"),
    ("json", b"\xff\xfe[1", r"x.*: the file is JSON, but "),
    ("json", b"[" * 10**5, r"x.*: the file is JSON, but "),
    ("json", b"7" * 5000, r"x.*: the file is JSON, but "),
    ("json", b'{"part": [1]}', r"x: labels are a list, but the file has the keys \['part'\]\. Write .* \"labels\""),
    ("json", b"3", r"x: labels are a list, but the file is a int"),
    ("json", b"[1, 2.0]", r"x, label 2: a label is an integer, a name or null, but this one is 2\.0"),
    ("json", b"[1, true]", r"x, label 2: .* but this one is true"),
    ("json", b"[1, [1]]", r"x, label 2: .* but this one is \[1\]"),
    ("json", b'[1, "two"]', r"x, label 2: a label is one of -1, 1, but this one is 'two'"),
    ("json", rb'["arm", "\ud800"]', r"x, label 2: a name is text, but this one is '\\ud800'"),
    ("npy", b"1\n2\n", r"x: a label file of the form npy is a NumPy array, but it begins"),
    ("npy", npy(np.zeros(3, "c16")), r"x: labels are an array of integers in one column, but it is .*c16"),
    ("npy", npy(np.array([1, 0.5])), r"x, index 1: labels are whole numbers, but this one is 0.5"),
    ("npy", npy(np.array([1, np.nan], "f4")), r"x, index 1: labels are whole numbers, but this one is nan"),
    ("npy", npy(np.array([1e9])), r"x, index 0: labels are whole numbers, but this one is 1000000000.0"),
    ("npy", npy(np.zeros((3, 2), dtype=int)), r"but it is .*\(3, 2\)"),
    ("npy", npy(np.array(3)), r"but it is .*\(\)"),
    ("npy", npy(np.array([True])), r"but it is .*b1"),
    ("npy", npy(np.array([1, "x"], dtype=object)), r"but it is .*\|O"),
    ("npy", npy(np.arange(3))[:-1], r"x: the array's 3 labels take 24 bytes, but 23 follow"),
    ("npy", npy(np.arange(3)).replace(b"(3,)", b"(3000000000,)"), r"but [0-9]+ follow"),
    ("npy", npy(np.array([1, 9])), r"x, index 1: a label is one of -1, 1, but this one is '9'"),
    ("ply", b"1\n2\n", r"x: labels of the form ply are in a PLY file, but this is none"),
    ("ply", ply("0 0 0 1 0\n0 0 0 1 0\n0 0 0 9 0\n3 0 1 2\n"), r"x:14: a label is one of -1, 1, but this one is '9'"),
    ("ply", ply("0 0 0 1 0\n0 0 0 1.5 0\n0 0 0 1 0\n3 0 1 2\n", "float"), r"x:13: .* whole .* this one is 1\.5"),
    ("ply", ply("0 0 0 1 0\n0 0 0 nan 0\n0 0 0 1 0\n3 0 1 2\n", "float"), r"x:13: .* whole .* this one is nan"),
    (
        "ply",
        ply("").replace(b" label", b" part"),
        r"one .* called 'label', but there are vertex x, .* vertex part\. ",
    ),
    ("ply", ply("").replace(b"float x", b"int label"), r"one property .* called 'label', but 2 have it"),
    ("obj-group", b"g 1\nf 1 2 3\ng arm\nf 1 2 3\n", r"x:2: a label is one of -1, 1, but this one is '1'"),
    ("obj-group", b"g a\nf \xff\n", r"x:2: the text is UTF-8, but it has byte 0xff"),
    ("psb", b"", r"x: a list of parts names faces, but this one names none"),
    ("psb", b"3 4\n", r"x:1: the name of a part is before its faces, but there is none"),
    ("psb", b"arm\n3 4\n\n5 x\n", r"x:4: numbers of faces are integers, but this is 'x'"),
    ("psb", b"arm\n3 4\n5 1_0\n", r"x:3: numbers of faces are integers, but this is '1_0'"),
    ("psb", b"arm\n3 4\n5 0\n", r"x:3: faces count from 1, but this is 0"),
    ("psb", b"arm\n3 4\nleg\n5 6\n7 4\n", r"x:5: a face is in one part, but face 4 is in 'arm' and 'leg'"),
    ("psb", b"1\n", r"x:1: the name of a part"),
    ("last-column", b"0 1\n0 2 1\n", r"x:2: the rows of the table have 2 columns, as the first, but this has 3"),
    ("last-column", b"0 1\n\n0 1\n", r"x:2: .* but this has 0"),
    ("last-column", b"x y label\n0 0 1\n", r"x:1: the last column is a number, but this one is 'label'"),
    ("last-column", b"0 1\n0 1.5\n", r"x:2: labels are whole numbers, but this one is 1\.5"),
    ("last-column", b"0 1\n0 inf\n", r"x:2: labels are whole numbers, but this one is inf"),
    ("last-column", b"0 1\n0 4\n", r"x:2: a label is one of -1, 1, but this one is '4'"),
]


@pytest.mark.parametrize(("form", "data", "message"), MISTAKES)
def test_a_mistake_is_told_with_its_place(form, data, message):
    with pytest.raises(InvalidMesh, match=f"{message}.*\\[bad-(label|encoding)\\]"):
        FORMS[form](data, "label" if form == "ply" else "", "x").classes({1: 0})


def test_a_face_that_the_mesh_has_not_is_told_with_its_line():
    file = LabelFile(path=Path("x"), form="psb", classes={"arm": 0})
    assert read_labels(file, b"arm\n12 1\n", BOX).faces.tolist() == [0, *[-1] * 10, 0]
    for number in ("13", "1" + "0" * 30):
        with pytest.raises(InvalidMesh, match=r"x:3: faces are numbered from 1 to 12, but this is .*\[bad-label\]"):
            read_labels(file, f"arm\n1 2\n3 {number} 4\n".encode(), BOX)


SEEDS = {
    "lines": b"1\n-1\narm\n",
    "npy": npy(np.array([1, -1, 2])),
    "json": b'{"labels": [1, null, "arm"]}',
    "ply": ply("0 0 0 1 0\n0 0 0 1 2 5 6\n0 0 0 9 0\n3 0 1 2\n"),
    "obj-group": b"v 0 0 0\ng arm # x\nf 1 1 \\\n1\no leg\nf 1 1 1\n",
    "obj-material": b"usemtl arm\nf 1 1 1\nusemtl leg\nf 1 1 1\n",
    "psb": b"arm\n1 2\n3\nleg\n4 5\n",
    "last-column": b"0.5 1 2\n0.25 1 3\n",
}


@pytest.mark.parametrize("form", FORMS)
def test_whatever_the_bytes_labels_or_a_refusal_come_out(form):
    rng = random.Random(form)
    read = 0
    for number in range(200):
        data = rng.randbytes(rng.randrange(40)) if number % 4 == 0 else damaged(SEEDS[form], rng)
        try:
            found = FORMS[form](data, "label" if form == "ply" else "", "x")
        except InvalidMesh:
            continue
        read += 1
        assert isinstance(found, Written)
        assert found.which.min(initial=0) >= -1
        assert found.which.max(initial=-1) < len(found.values)
        assert found.numbers is None or len(found.numbers) == len(found.which)
        for place in map(found.place, range(len(found.which))):
            assert place.startswith("x")
    assert 0 < read < 200 or form in ("lines", "obj-group", "obj-material")


@pytest.mark.parametrize("form", ["ply", "obj-group"])
def test_whatever_the_bytes_a_mesh_file_can_be_asked_for_labels(form):
    rng = random.Random(form)
    for _ in range(100):
        data = damaged(SEEDS[form], rng)
        for found, name, domain in offered(data, f".{form[:3]}"):
            with contextlib.suppress(InvalidMesh):  # of a PLY only the header was read
                assert FORMS[found](data, name, "x").domain == domain


def damaged(data, rng):
    """Some bytes removed, added, changed or repeated."""
    content = bytearray(data)
    for _ in range(rng.randrange(4)):
        at = rng.randrange(len(content) + 1)
        end = min(len(content), at + rng.randrange(6))
        content[at:end] = rng.choice([b"", rng.randbytes(3), b"\n", b"9" * 30, b"-", b"_", content[at:end] * 3])
    return bytes(content)
