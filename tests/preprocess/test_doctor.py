import json
import os
from pathlib import Path

import numpy as np
import pytest
from corruptions import corrupted
from program import meshshard
from shapes import FAMILY, box, grid, sphere, torus, write_labels, write_obj

from meshshard.errors import InvalidMesh, UsageError
from meshshard.recipe import RECIPES
from meshshard_prep.datasets import Entry, LabelFile
from meshshard_prep.doctor import diagnose, entries_at, examine
from meshshard_prep.doctor_report import oddities, rows, verdict
from meshshard_prep.formats import read_mesh
from meshshard_prep.isolation import Limits
from meshshard_prep.pipeline import features_of

PAPER = RECIPES["paper"]
DOCS = Path(__file__).parents[2] / "docs"


def only(path, recipe=PAPER):
    (entry,) = entries_at(path)
    return diagnose(entry, recipe)


@pytest.mark.parametrize("name", FAMILY)
def test_counts_and_bound_are_those_of_the_stored_sample(name, tmp_path):
    write_obj(tmp_path / "a.obj", *FAMILY[name])
    diagnosis = only(tmp_path / "a.obj")
    sample = features_of(read_mesh(tmp_path / "a.obj"), PAPER)
    assert diagnosis.refusal is None
    assert diagnosis.found["counts"] == sample.diagnostics
    assert diagnosis.found["hks"] == {"error_bound": sample.hks_error_bound, "poles": sample.hks_poles}
    assert diagnosis.found["format"] == "OBJ"
    vertices, faces = FAMILY[name]
    sizes = {"vertices": len(vertices), "polygons": len(faces), "triangles": len(faces)}
    assert sizes.items() <= diagnosis.found.items()


def test_a_refused_mesh_shows_what_could_be_found(tmp_path):
    path = tmp_path / "a.off"
    path.write_text("OFF\n3 1 0\n0 0 0\n1 0 0\n2 0 nan\n3 0 1 2\n")
    found = only(path)
    assert (found.refusal.code, found.found) == ("not-finite", {"bytes": 38, "format": "OFF"})
    path.write_text("OFF\n4 2 0\n0 0 0\n0 0 0\n1 0 0\n2 0 0\n3 0 1 2\n4 3 1 0 3\n")
    found = only(path)
    assert found.refusal.code == "no-faces"
    assert {"vertices": 4, "polygons": 2, "triangles": 3}.items() <= found.found.items()
    assert "counts" not in found.found
    path.write_text("solid x")
    assert (only(path).refusal.code, only(path).found) == ("unsupported-format", {"bytes": 7})


def test_a_mesh_that_only_its_features_refuse_keeps_its_facts(tmp_path):
    vertices, faces = sphere(1)
    speck = 1e-9 * np.eye(3) + 0.5
    write_obj(tmp_path / "a.obj", np.vstack([vertices, speck]), np.vstack([faces, [[18, 19, 20]]]))
    found = only(tmp_path / "a.obj")
    assert found.refusal.code == "inexact-hks"
    assert found.found["piece_faces"] == (32, 1)
    assert found.found["counts"]["boundary_edges"] == 3
    assert oddities(found) == "2 pieces, 3 boundary edges, 2 vertices that float32 merges"
    assert "hks" not in found.found


def test_labels_of_every_form_and_what_a_mesh_file_offers(tmp_path):
    vertices, faces = box()
    lines = [f"v {x} {y} {z}" for x, y, z in vertices.tolist()]
    for number, face in enumerate(faces.tolist()):
        lines += ["g arm" if number % 3 else "g leg", f"f {' '.join(str(corner + 1) for corner in face)}"]
    (tmp_path / "a.obj").write_text("\n".join([*lines, ""]))
    (tmp_path / "a.txt").write_text("arm\n1 2 3\nleg\n5\n")
    (tmp_path / "a.json").write_text(json.dumps([None, "arm"] * 4))
    table = {"arm": 1, "leg": 0}
    expected = {
        "obj-group": ("a.obj", {"leg": 4, "arm": 8}),
        "psb": ("a.txt", {"-1": 8, "leg": 1, "arm": 3}),
        "json": ("a.json", {"-1": 4, "arm": 4}),
    }
    for form, (name, shares) in expected.items():
        labels = LabelFile(path=tmp_path / name, form=form, classes=table, to="vertex")
        diagnosis = diagnose(Entry(id="a", path=tmp_path / "a.obj", source="a.obj", labels=labels), PAPER)
        found = diagnosis.found
        assert (found["labels"]["file"], found["labels"]["lines"]) == (name, shares)
        assert found["labels"]["domain"] == ("vertex" if form == "json" else "face")
        assert ("rule" in found["labels"]) == (form != "json")
        assert found["offered"] == [{"form": "obj-group", "name": "", "domain": "face"}]
        shown = dict(rows(diagnosis))
        assert shown["could be labels"] == "obj-group"
        assert ("labels stored" in shown) == (form != "json")


def test_label_files_beside_a_mesh(tmp_path):
    write_obj(tmp_path / "a.obj", *box())
    write_labels(tmp_path / "a.seg", [7, -1, 3] * 4)
    for path in (tmp_path, tmp_path / "a.obj"):
        found = only(path)
        assert found.found["labels"] == {"file": "a.seg", "domain": "face", "lines": {"-1": 4, "3": 4, "7": 4}}
        assert found.found["counts"]["unlabelled"] == 4
    write_labels(tmp_path / "a.seg", [1] * 11)
    found = only(tmp_path / "a.obj")
    assert found.refusal.code == "label-count"
    assert "labels" not in found.found
    assert found.found["euler_characteristic"] == 2
    write_obj(tmp_path / "b.obj", *box())
    assert [diagnose(entry, PAPER).refusal.code for entry in entries_at(tmp_path)] == ["label-count", "no-labels"]
    assert only(tmp_path / "b.obj").refusal is None


def test_every_row_of_one_mesh(tmp_path):
    vertices, faces = torus()
    faces[0] = faces[0, ::-1]
    vertices = np.vstack([vertices, vertices[:1], [[0, 0, 9]]])
    faces = np.vstack([faces[:-1], [[96, 1, 0]]])
    write_obj(tmp_path / "a.obj", vertices, faces)
    found = dict(rows(only(tmp_path / "a.obj")))
    assert found.pop("mesh") == str(tmp_path / "a.obj")
    assert found.pop("file").startswith("OBJ, ")
    assert found.pop("verdict").startswith("usable: relative error of hks at most ")
    assert found == {
        "vertices": "98",
        "faces": "192 polygons, 192 triangles",
        "working copy": "1 vertices welded, 1 degenerate faces left out, 1 vertices without a face left out",
        "odd faces": "0 without area, 0 duplicate",
        "pieces": "1, 0 closed; faces: 191",
        "boundary": "3 edges in 1 loops",
        "non-manifold": "0 edges, 0 bow-tie vertices",
        "orientation": "orientable, 3 edges whose faces disagree, 0 pieces inside out",
        "topology": "Euler characteristic -1, genus 1",
        "size": found["size"],
        "edges": found["edges"],
    }
    assert found["size"].startswith("2.8 x 2.8 x 9.4, radius 1.4")


def code_of(path):
    try:
        features_of(read_mesh(path), PAPER)
    except InvalidMesh as error:
        return error.code
    return ""


def test_any_broken_file_gets_a_diagnosis(tmp_path):
    path = tmp_path / "mesh.obj"
    for seed in range(150):
        path.write_bytes(corrupted(seed)[1])
        found = only(path)
        assert found.found["bytes"] == path.stat().st_size
        assert found.table()["usable"] == (found.refusal is None) == ("hks" in found.found)
        assert dict(rows(found))["verdict"] == verdict(found)
        assert found.table()["code"] == code_of(path)


def test_command_for_one_mesh_for_a_folder_and_for_machines(tmp_path):
    write_obj(tmp_path / "good.obj", *sphere(1))
    write_obj(tmp_path / "sub" / "open.obj", *grid(2, 2))
    status, out, error = meshshard("doctor", "good.obj", cwd=tmp_path)
    assert (status, error) == (0, "")
    assert "topology\tEuler characteristic 2, genus 0\n" in out
    (tmp_path / "bad.ply").write_text("ply\n")
    status, out, error = meshshard("doctor", ".", cwd=tmp_path)
    assert (status, error) == (1, "")
    assert out.splitlines()[0].startswith("bad.ply\trefused: bad.ply:1: a PLY header ends with end_header")
    assert out.splitlines()[2].startswith("sub/open.obj\tusable: ")
    assert out.splitlines()[2].endswith("\t8 boundary edges")
    assert out.splitlines()[3] == "2 usable, 1 refused"
    status, out, _ = meshshard("doctor", "bad.ply", "sub", "--json", "--recipe", "official", cwd=tmp_path)
    found = json.loads(out)
    assert (status, found["usable"], found["refused"]) == (1, 1, 1)
    assert [(mesh["usable"], mesh["code"]) for mesh in found["meshes"]] == [(False, "truncated"), (True, "")]
    documented = (DOCS / "cli.md").read_text().split("## meshshard doctor")[1].split("\n## ")[0]
    assert [key for key in ["labels", "offered", *found["meshes"][1]] if f"`{key}`" not in documented] == []


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("nowhere",), "there is no nowhere; name mesh files, or folders of them"),
        (("empty",), "empty holds no mesh"),
        (("good.obj", "--recipe", "x"), "no recipe is called 'x'"),
    ],
)
def test_nothing_could_be_done(words, message, tmp_path):
    write_obj(tmp_path / "good.obj", *sphere(0))
    (tmp_path / "empty").mkdir()
    status, out, error = meshshard("doctor", *words, cwd=tmp_path)
    assert (status, out) == (2, "")
    assert message in " ".join(error.split())


def test_names_that_are_not_utf8(tmp_path):
    path = Path(os.fsdecode(os.fsencode(tmp_path) + b"/a\xff.obj"))
    write_obj(path, *box())
    found = only(path)
    assert found.refusal.code == "bad-name"
    assert found.source.endswith("a\\xff.obj")
    json.dumps(found.table()).encode()


def test_two_label_files_cannot_both_be_meant(tmp_path):
    write_obj(tmp_path / "a.obj", *box())
    for suffix in (".seg", ".txt"):
        write_labels((tmp_path / "a.obj").with_suffix(suffix), [1] * 12)
    with pytest.raises(UsageError, match="two label files"):
        entries_at(tmp_path / "a.obj")


def test_a_mesh_that_breaks_its_process_costs_its_own_diagnosis(tmp_path):
    write_obj(tmp_path / "a.obj", *sphere(5))
    (entry,) = entries_at(tmp_path / "a.obj")
    found = examine(entry, PAPER, Limits(seconds=0.001))
    assert (found.refusal.code, found.found) == ("time-limit", {})
    assert verdict(found) == "failed: it was stopped after 0.001 s [time-limit]"
    assert examine(entry, PAPER, Limits()).table() == diagnose(entry, PAPER).table()
