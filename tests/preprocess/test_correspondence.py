"""Correspondence from file to shard: exact where it is right, refused with the line where it is wrong."""

import re
from dataclasses import replace

import numpy as np
import pytest
from light import LIGHT
from shapes import FAMILY, bumpy, write_labels, write_obj

from meshshard import open_dataset
from meshshard.errors import UsageError
from meshshard.verify import verify
from meshshard_prep.datasets import Entry, RawDataset
from meshshard_prep.plan import make_plan
from meshshard_prep.run import run
from meshshard_train.graphs import graph_of


def remeshed(root, template, seeds=range(3)):
    """The same bumpy sphere, its vertices renumbered for each seed: where each vertex went is known. The files are
    1-based and name `template` of the vertices."""
    entries, truth = [], {}
    vertices, faces = bumpy(1)
    for seed in seeds:
        order = np.random.default_rng(seed).permutation(len(vertices))
        place = np.argsort(order)
        write_obj(root / "off" / f"{seed}.obj", vertices[order], place[faces])
        truth[str(seed)] = place[:template]
        write_labels(root / "corres" / f"{seed}.vts", place[:template] + 1)
        entries.append(entry(root, str(seed), template))
    return RawDataset(name="toy", task="correspondence", classes=(), entries=tuple(entries)), truth


def entry(root, name, template):
    path = root / "off" / f"{name}.obj"
    vts = root / "corres" / f"{name}.vts"
    return Entry(id=name, path=path, source=f"off/{name}.obj", correspondence=vts, template=template)


def test_corresponding_vertices_are_the_same_point(tmp_path):
    dataset, truth = remeshed(tmp_path / "raw", template=50)
    assert run(dataset, tmp_path / "out", LIGHT, jobs=1).ok
    samples = {sample.id: sample for sample in open_dataset(tmp_path / "out")}
    for name, places in truth.items():
        np.testing.assert_array_equal(samples[name].correspondence, places)
        points = samples[name].vertices[samples[name].correspondence]
        np.testing.assert_allclose(points, samples["0"].vertices[samples["0"].correspondence], atol=1e-6)
    assert open_dataset(tmp_path / "out").task == "correspondence"
    assert verify(tmp_path / "out", full=True) == []


def test_the_templates_own_vertices_are_the_identity(tmp_path):
    vertices, faces = FAMILY["torus"]
    write_obj(tmp_path / "raw" / "a.obj", vertices, faces)
    path = tmp_path / "raw" / "a.obj"
    one = Entry(id="a", path=path, source="a.obj", correspondence=path, template=len(vertices))
    dataset = RawDataset(name="toy", task="correspondence", classes=(), entries=(one,))
    assert run(dataset, tmp_path / "out", LIGHT, jobs=1).ok
    (sample,) = open_dataset(tmp_path / "out")
    np.testing.assert_array_equal(sample.correspondence, np.arange(len(vertices)))


def test_no_vertex_is_minus_one(tmp_path):
    dataset, _ = remeshed(tmp_path / "raw", template=5, seeds=[0])
    (tmp_path / "raw" / "corres" / "0.vts").write_text("-1\r\n" * 4 + "66\n\n")
    assert run(dataset, tmp_path / "out", LIGHT, jobs=1).ok
    assert open_dataset(tmp_path / "out")[0].correspondence.tolist() == [-1, -1, -1, -1, 65]


@pytest.mark.parametrize(
    ("text", "code", "words"),
    [
        ("1\n2\nx\n", "bad-correspondence", "1.vts:3: .*1 to 66.*'x'"),
        ("1\n0\n3\n", "bad-correspondence", "1.vts:2: .*'0'"),
        ("1\n2\n67\n", "bad-correspondence", "1.vts:3: .*'67'"),
        ("1\n2\n" + "9" * 40, "bad-correspondence", "1.vts:3: "),
        ("1\n\n3\n", "bad-correspondence", "1.vts:2: .*''"),
        ("1\n-2\n3\n", "bad-correspondence", "1.vts:2: .*'-2'"),
        ("1\n2\n", "correspondence-count", "template has 3 vertices.*there are 2"),
        ("1\n2\n3\n4\n", "correspondence-count", "template has 3 vertices.*there are 4"),
        ("", "correspondence-count", "there are 0"),
        (None, "no-correspondence", r"off/1.obj: .*1.vts.*Put it at corres/1.vts"),
    ],
)
def test_what_is_wrong_costs_that_mesh_and_names_the_line(tmp_path, text, code, words):
    dataset, _ = remeshed(tmp_path / "raw", template=3)
    file = tmp_path / "raw" / "corres" / "1.vts"
    file.unlink() if text is None else file.write_text(text)
    report = run(dataset, tmp_path / "out", LIGHT, jobs=1)
    assert report.index.ids == ("0", "2")
    (refused,) = report.index.refused
    assert refused.code == code
    assert re.search(words, refused.message), refused.message


def test_a_changed_file_computes_that_mesh_anew(tmp_path):
    dataset, _ = remeshed(tmp_path / "raw", template=3)
    run(dataset, tmp_path / "out", LIGHT, jobs=1)
    assert run(dataset, tmp_path / "out", LIGHT, jobs=1).computed == 0
    (tmp_path / "raw" / "corres" / "2.vts").write_text("7\n8\n9\n")
    assert make_plan(dataset, tmp_path / "out", LIGHT).todo == {"2": "correspondence changed"}
    assert run(dataset, tmp_path / "out", LIGHT, jobs=1).computed == 1
    assert open_dataset(tmp_path / "out")[2].correspondence.tolist() == [6, 7, 8]


def test_its_graphs_have_no_labels(tmp_path):
    dataset, _ = remeshed(tmp_path / "raw", template=3, seeds=[0])
    run(dataset, tmp_path / "out", LIGHT, jobs=1)
    assert "y" not in graph_of(open_dataset(tmp_path / "out")[0], "correspondence", ("vertices",))


@pytest.mark.parametrize("change", [{"steps": ("weld",)}, {"steps": ("largest_component",)}, {"simplify": 20}])
def test_recipes_that_take_vertices_away_are_refused(tmp_path, change):
    dataset, _ = remeshed(tmp_path / "raw", template=3)
    with pytest.raises(UsageError, match=r"which vertex of each mesh file.*recipe light would take vertices away"):
        run(dataset, tmp_path / "out", replace(LIGHT, **change), jobs=1)
