import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from faults import FAULTS
from prepared import soup, start
from shapes import FAMILY, bumpy, grid, joined, rotation, sphere, torus, write_obj

from meshshard.errors import InvalidMesh, UsageError
from meshshard.recipe import Recipe
from meshshard_prep.datasets import read_dataset
from meshshard_prep.facts import facts_of
from meshshard_prep.features.areas import face_areas
from meshshard_prep.features.edges import edges_of
from meshshard_prep.isolation import Limits
from meshshard_prep.prepare.samples import sample_points
from meshshard_prep.prepare.simplify import simplify
from meshshard_prep.run import run

CLOSED = {"sphere": sphere(4), "torus": torus(40, 30), "bumpy": bumpy(3, 4), "two": joined(sphere(3), torus(20, 20))}


def facts(mesh):
    return facts_of(mesh.vertices, mesh.faces, edges_of(mesh.faces))


@pytest.mark.parametrize("target", [500, 100])
@pytest.mark.parametrize("name", CLOSED)
def test_the_number_of_faces_is_reached_and_the_topology_kept(name, target):
    vertices, faces = CLOSED[name]
    mesh, counts = simplify(start(vertices, faces), target)
    assert len(mesh.faces) == target
    assert counts == {"faces_before": len(faces)}
    before, after = facts(start(vertices, faces)), facts(mesh)
    for what in ("closed_pieces", "genus", "bowtie_vertices", "disagreeing_edges", "inside_out_pieces"):
        assert getattr(after, what) == getattr(before, what)
    assert sorted(set(mesh.faces.ravel().tolist())) == list(range(len(mesh.vertices)))


@pytest.mark.parametrize(("name", "area"), [("sphere", 4 * np.pi), ("torus", 4 * np.pi**2 * 0.4)])
def test_areas_stay_near_those_of_the_surface(name, area):
    mesh, _ = simplify(start(*CLOSED[name]), 400)
    assert face_areas(mesh.vertices, mesh.faces).sum() == pytest.approx(area, rel=0.01)


def test_seams_are_closed_first():
    mesh, counts = simplify(start(*soup(*sphere(4))), 200)
    assert counts == {"faces_before": 2048}
    assert (len(mesh.faces), facts(mesh).closed_pieces) == (200, 1)


def test_a_flat_sheet_keeps_its_border_and_its_area():
    vertices, faces = grid(20, 20)
    mesh, _ = simplify(start(vertices, faces), 60)
    assert 55 <= len(mesh.faces) <= 60  # at a border a collapse takes one face, elsewhere two
    assert face_areas(mesh.vertices, mesh.faces).sum() == pytest.approx(400)
    np.testing.assert_allclose(mesh.vertices[:, 2], 0, atol=1e-12)


@pytest.mark.parametrize("name", FAMILY)
def test_a_mesh_with_no_more_faces_stays_as_it_is(name):
    vertices, faces = FAMILY[name]
    mesh, counts = simplify(start(vertices, faces), len(faces))
    assert counts == {"faces_before": len(faces)}
    np.testing.assert_array_equal(mesh.vertices, vertices)
    np.testing.assert_array_equal(mesh.faces, faces)


def test_it_stops_above_the_target_where_the_topology_asks_for_it():
    mesh, counts = simplify(start(*torus(20, 20)), 4)
    assert 4 < len(mesh.faces) < 40
    assert facts(mesh).genus == 1
    assert counts == {"faces_before": 800}


def squared_distances(points, corners):
    """Of each point to each triangle: to its plane, where it lies above it, and to its sides. By the book, slowly."""
    points, (a, b, c) = points[:, None], np.moveaxis(corners, 1, 0)
    normal = np.cross(b - a, c - a)
    inside = np.ones((len(points), len(corners)), dtype=bool)
    best = np.full(inside.shape, np.inf)
    for tail, head in ((a, b), (b, c), (c, a)):
        side = head - tail
        along = np.clip(((points - tail) * side).sum(-1) / np.square(side).sum(-1), 0, 1)
        best = np.minimum(best, np.square(points - tail - along[..., None] * side).sum(-1))
        inside &= (np.cross(side, points - tail) * normal).sum(-1) >= 0
    plane = np.square(((points - a) * normal).sum(-1)) / np.square(normal).sum(-1)
    return np.where(inside, plane, best)


def test_sources_are_the_nearest():
    vertices, faces = bumpy(5, 3)
    mesh, _ = simplify(start(vertices, faces), 60)
    distance = squared_distances(sample_points(mesh.vertices[mesh.faces]).reshape(-1, 3), vertices[faces])
    found = distance[np.arange(len(distance)), mesh.triangle_sources.ravel()]
    np.testing.assert_allclose(np.sqrt(found), np.sqrt(distance.min(axis=1)), atol=1e-9)
    to_vertices = np.linalg.norm(mesh.vertices[:, None] - vertices, axis=2)
    np.testing.assert_array_equal(mesh.vertex_source, to_vertices.argmin(axis=1))


def test_faces_without_area_and_vertices_without_faces_are_no_source():
    vertices, faces = grid(8, 8)
    needle = [[0, 9, 18]]  # along a side of the sheet
    mesh, _ = simplify(start(np.vstack([[[0, 0, 0]], vertices]), np.vstack([needle, faces]) + 1), 60)
    assert mesh.triangle_sources.min() > 0
    assert mesh.vertex_source.min() > 0


def test_moved_turned_and_scaled():
    vertices, faces = bumpy(7, 3)
    turn = rotation(1)
    expected, _ = simplify(start(vertices, faces), 100)
    found, _ = simplify(start(1e-4 * vertices @ turn.T + [5, 6, 7], faces), 100)
    np.testing.assert_array_equal(found.faces, expected.faces)
    np.testing.assert_allclose(found.vertices, 1e-4 * expected.vertices @ turn.T + [5, 6, 7], rtol=1e-9)
    np.testing.assert_array_equal(found.vertex_source, expected.vertex_source)


def test_a_mesh_without_area_is_refused():
    vertices = np.array([[x, 0.0, 0.0] for x in range(20)])
    with pytest.raises(InvalidMesh) as refusal:
        simplify(start(vertices, [[i, i + 1, i + 2] for i in range(18)]), 4)
    assert refusal.value.code == "no-faces"
    assert "test.obj: a simplified mesh has faces, but none is left of 18" in str(refusal.value)


def in_new_thread(function, *arguments):
    """Processes belong to threads: a new one starts its own, and ends them."""
    with ThreadPoolExecutor(1) as pool:
        return pool.submit(function, *arguments).result()


def test_the_same_bytes_whatever_was_simplified_before():
    """pymeshlab keeps settings from call to call, and its heap could depend on addresses."""
    others = [start(*grid(20, 20)), start(*torus(40, 30)), start(*FAMILY["fin"])]
    mesh = start(*CLOSED["bumpy"])
    alone, _ = in_new_thread(simplify, mesh, 150)

    def after_others():
        for other in others:
            simplify(other, 30)
        return simplify(mesh, 150)

    later, _ = in_new_thread(after_others)
    for name in ("vertices", "faces", "vertex_source", "triangle_sources"):
        assert getattr(alone, name).tobytes() == getattr(later, name).tobytes()


def test_pymeshlab_is_not_in_this_process():
    simplify(start(*sphere(2)), 20)
    assert "pymeshlab" not in sys.modules


FAKE = """
import os
from pathlib import Path
from faults import FAULTS
class Mesh:
    def __init__(self, vertices, faces):
        self.vertices, self.faces = vertices, faces
    def vertex_matrix(self):
        return self.vertices
    def face_matrix(self):
        return self.faces
class MeshSet:
    def add_mesh(self, mesh):
        self.mesh = mesh
    def current_mesh(self):
        return self.mesh
    def meshing_decimation_quadric_edge_collapse(self, **_):
        print("noise on standard output" * 10_000)
        Path({pid!r}).write_text(str(os.getpid()))
        if len(self.mesh.faces) == 32:
            FAULTS[{fault!r}][0]()
"""


@pytest.fixture
def broken(tmp_path, monkeypatch):
    """Processes that start find another pymeshlab: it leaves meshes as they are, and does something to one of 32
    faces. Returns what makes it, for a fault; its process's id is then written to `pid`."""

    def make(fault):
        (tmp_path / "lib").mkdir()
        text = FAKE.format(fault=fault, pid=str(tmp_path / "pid"))
        (tmp_path / "lib" / "pymeshlab.py").write_text(text)
        monkeypatch.syspath_prepend(tmp_path / "lib")

    return make


@pytest.mark.parametrize("fault", ["segfault", "kill", "allocate", "unpicklable"])
def test_what_kills_that_process_costs_one_mesh_and_is_named(tmp_path, broken, fault):
    broken(fault)
    for name, mesh in {"bad": sphere(1), "good": sphere(2)}.items():
        write_obj(tmp_path / "raw" / f"{name}.obj", *mesh)
    recipe, limits = Recipe(name="fewer", simplify=20), Limits(memory=2 * 10**9)
    report = in_new_thread(
        lambda: run(read_dataset(str(tmp_path / "raw")), tmp_path / "out", recipe, jobs=1, limits=limits)
    )
    assert report.index.ids == ("good",)
    (culprit,) = report.index.failed
    assert culprit.code == FAULTS[fault][1]
    assert culprit.message.startswith("bad.obj: while it was simplified, ")
    assert FAULTS[fault][2] in culprit.message


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere a process ends when it looks at its pipe")
def test_a_hang_ends_with_the_process_that_waits_for_it(tmp_path, broken):
    broken("hang")
    write_obj(tmp_path / "raw" / "bad.obj", *sphere(1))
    dataset, recipe = read_dataset(str(tmp_path / "raw")), Recipe(name="fewer", simplify=20)
    report = in_new_thread(lambda: run(dataset, tmp_path / "out", recipe, jobs=1, limits=Limits(seconds=1.0)))
    assert [entry.code for entry in report.index.failed] == ["time-limit"]
    process, end = Path("/proc") / (tmp_path / "pid").read_text(), time.monotonic() + 2
    while process.exists():
        assert time.monotonic() < end
        time.sleep(0.02)


def test_without_pymeshlab_nothing_begins(tmp_path, monkeypatch):
    (tmp_path / "pymeshlab.py").write_text("raise ModuleNotFoundError(\"No module named 'pymeshlab'\")\n")
    monkeypatch.syspath_prepend(tmp_path)
    write_obj(tmp_path / "raw" / "a.obj", *sphere(1))
    dataset = read_dataset(str(tmp_path / "raw"))
    with pytest.raises(UsageError, match=r"simplify needs pymeshlab.*pip install 'meshshard\[simplify\]'"):
        in_new_thread(lambda: run(dataset, tmp_path / "out", Recipe(name="fewer", simplify=20), jobs=1))
    plain = in_new_thread(lambda: run(dataset, tmp_path / "out", Recipe(name="plain"), jobs=1))
    assert plain.ok
