"""What a mesh file itself offers as labels."""

import pytest

from meshshard_prep.labels import offered
from meshshard_prep.labels.ply import left_out

OBJ = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"


@pytest.mark.parametrize(
    ("text", "forms"),
    [
        ("f 1 2 3\n", []),
        ("g a\nf 1 2 3\n", []),
        ("g a\nf 1 2 3\ng b\n", []),  # b has no face
        ("f 1 2 3\ng b\nf 1 2 3\n", []),
        ("g a\nf 1 2 3\no b\nf 1 2 3\n", ["obj-group"]),
        ("usemtl a\nf 1 2 3\nusemtl b\nf 1 2 3\n", ["obj-material"]),
        ("g a\nusemtl a\nf 1 2 3\ng b\nusemtl b\nf 1 2 3\n", ["obj-group", "obj-material"]),
    ],
)
def test_groups_and_materials_of_an_obj_where_faces_are_in_two(text, forms):
    assert offered((OBJ + text).encode(), ".obj") == [(form, "", "face") for form in forms]


def ply(vertex, face):
    lines = ["ply", "format ascii 1.0", "element vertex 3", *(f"property float {axis}" for axis in "xyz"), *vertex]
    lines += ["element face 1", "property list uchar int vertex_indices", *face, "end_header", ""]
    return "\n".join(lines).encode()


@pytest.mark.parametrize(
    ("vertex", "face", "expected"),
    [
        ([], [], []),
        (["property uchar red", "property int flags"], ["property uchar alpha", "property int texnumber"], []),
        (["property float quality"], ["property list uchar int texcoord"], []),
        (["property int part"], [], [("ply", "part", "vertex")]),
        ([], ["property uchar label", "property uint8 patch"], [("ply", "label", "face"), ("ply", "patch", "face")]),
        (
            ["property int label"],
            ["property int label"],
            [("ply", "face label", "face"), ("ply", "vertex label", "vertex")],
        ),
    ],
)
def test_integer_properties_of_a_ply_other_than_colours(vertex, face, expected):
    assert offered(ply(vertex, face), ".ply") == expected


WHOLE = """ply
format ascii 1.0
element vertex 3
property float x
property float y
property float z
property float quality
property float same
property uchar red
element face 2
property list uchar int vertex_indices
property double segment
end_header
0 0 0 0.5 1 9
1 0 0 2 1 9
0 1 0 1e400 1 9
3 0 1 2 1
3 2 1 0 3.0
"""


def test_whole_floating_point_numbers_are_labels_where_they_are_not_all_alike():
    assert offered(WHOLE.encode(), ".ply") == [("ply", "segment", "face")]
    assert left_out(WHOLE.encode(), "") == ["vertex quality", "vertex same", "vertex red"]
    assert left_out(b"OFF\n", "") == []


@pytest.mark.parametrize("data", [b"", b"OFF\n3 1 0\n", b"\x89PNG", b"ply\nformat no\n", b"g a\nf\xff\n"])
def test_what_is_no_mesh_offers_nothing(data):
    assert offered(data, ".obj") == []
