"""Quick counts are those of the reader, and what has none is no mesh."""

import numpy as np
import pytest
from shapes import FAMILY, write_obj

from meshshard_prep.counts import counts_of
from meshshard_prep.features.edges import edges_of
from meshshard_prep.formats import parse_mesh


def texts(vertices, faces):
    """One mesh as several files could have it."""
    obj_v = "".join(f"v {x} {y} {z}\n" for x, y, z in vertices)
    obj_f = [" ".join(f"{i + 1}//{i + 1}" for i in face) for face in faces]
    rows = "".join(f"{x} {y} {z}\n" for x, y, z in vertices) + "".join(f"3 {a} {b} {c}\n" for a, b, c in faces)
    ply = f"ply\nformat ascii 1.0\ncomment element face 9\nelement vertex {len(vertices)}\n" + "".join(
        f"property double {axis}\n" for axis in "xyz"
    )
    ply += f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    return {
        "plain.obj": obj_v + "".join(f"f {face}\n" for face in obj_f),
        "dressed.obj": "# v f\nvn 0 0 1\r\n" + obj_v + "g f\n" + "".join(f"  f\t{face}\r\n" for face in obj_f),
        "plain.off": f"OFF\n{len(vertices)} {len(faces)} 0\n{rows}",
        "old.obj": (obj_v + "".join(f"f {face}\n" for face in obj_f)).replace("\n", "\r"),
        "glued.off": f"# made by f\nOFF{len(vertices)} {len(faces)} 0\n{rows}",
        "named wrongly.obj": f"OFF # 3 4\n# 5\n{len(vertices)} {len(faces)} 0\n{rows}",
        "text.ply": ply + rows,
    }


@pytest.mark.parametrize("family", sorted(FAMILY))
def test_counts_are_those_of_the_reader(tmp_path, family):
    for name, text in texts(*FAMILY[family]).items():
        (tmp_path / name).write_text(text, newline="")
        data = (tmp_path / name).read_bytes()
        mesh = parse_mesh(data, name)
        counts = counts_of(tmp_path / name, data)
        assert (counts.vertices, counts.faces, counts.refusal) == (len(mesh.vertices), mesh.polygons, "")
        assert counts.edges == len(edges_of(mesh.faces).ends)
        assert counts.fits(mesh.polygons) == (("face", "vertex") if family == "tetrahedron" else ("face",))
        assert counts.fits(counts.edges) == ("edge",)
        assert counts.fits(counts.edges + 10**6) == ()


def test_triangles_of_a_soup_have_as_many_edges_as_vertices(tmp_path):
    vertices, faces = np.random.default_rng(0).random((30, 3)), np.arange(30).reshape(10, 3)
    write_obj(tmp_path / "a.obj", vertices, faces)
    assert counts_of(tmp_path / "a.obj", (tmp_path / "a.obj").read_bytes()).fits(30) == ("vertex", "edge")


def test_edges_of_other_polygons_are_not_counted(tmp_path):
    write_obj(tmp_path / "a.obj", np.eye(4, 3), np.array([[0, 1, 2]]))
    with (tmp_path / "a.obj").open("a") as file:
        file.write("f 1 2 3 4\n")
    counts = counts_of(tmp_path / "a.obj", (tmp_path / "a.obj").read_bytes())
    assert (counts.vertices, counts.faces, counts.edges) == (4, 2, 0)


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"OFF\n999999999999 12 0\n",
        b"OFF\n",
        b"ply\nformat ascii 1.0\nelement vertex 88888888888\nproperty float x\nend_header\n",
        b"solid x\n",
        b"\x7fELF" + bytes(100),
        b"version https://git-lfs",
    ],
)
def test_what_is_no_mesh_says_why(tmp_path, data):
    counts = counts_of(tmp_path / "a.off", data)
    assert (counts.vertices, counts.faces) == (0, 0)
    assert counts.refusal.startswith("a.off")
