"""What is written for a mesh: label files by the rule of exported ones, probabilities beside them, both in PLY."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from plyfile import PlyData
from samples import PAPER, sample

from meshshard.label_lines import as_lines, line_labels
from meshshard.palette import colours_of
from meshshard.sample import DIAGNOSTICS
from meshshard_train.prediction_files import Outputs, write_mesh

OUTPUTS = Outputs(
    task="segmentation",
    classes=("low", "middle", "high"),
    colours=("#010203", "#405060", "#FFEEDD"),
    recipe=PAPER,
    rounds=2,
    pictures=False,
)


def drawn(count, classes=3, seed=0):
    """Probabilities of some faces, say, and the most probable class of each."""
    rows = np.random.default_rng(seed).dirichlet(np.ones(classes), count).astype(np.float32)
    return rows, rows.argmax(axis=1)


def written(folder, outputs, mesh, labels, probabilities):
    """What is told of a mesh, its PLY, and the lines of .seg and .confidence."""
    found = write_mesh(outputs, mesh, labels, probabilities, Path("m.obj"), folder / "m")
    assert json.loads((folder / "m.json").read_text()) == found
    seg, confidence = ((folder / f"m.{ending}").read_text().split() for ending in ("seg", "confidence"))
    return found, PlyData.read(folder / "m.ply"), [int(line) for line in seg], [float(line) for line in confidence]


@pytest.mark.parametrize("simplify", [0, 8])
def test_lines_of_faces_are_those_of_the_rule(tmp_path, simplify):
    recipe = replace(PAPER, steps=("weld",), simplify=simplify)
    source = np.repeat(np.arange(0, 32, 2, dtype="i4"), 2)  # quads; every other face of the file was left out
    counts = dict.fromkeys(DIAGNOSTICS, 0) | {"dropped_faces": 32}
    mesh = sample(1, face_source=source, polygons=32, vertex_source=np.arange(18, dtype="i4"), diagnostics=counts)
    probabilities, labels = drawn(32)
    found, ply, lines, confidence = written(tmp_path, replace(OUTPUTS, recipe=recipe), mesh, labels, probabilities)
    assert (tmp_path / "m.seg").read_bytes() == as_lines(line_labels(mesh, labels, recipe))
    assert np.array(ply["face"]["label"]).tolist() == labels.tolist()
    np.testing.assert_allclose(ply["face"]["confidence"], probabilities.max(axis=1))
    rgb = np.stack([ply["face"][name] for name in ("red", "green", "blue")], axis=1)
    np.testing.assert_array_equal(rgb, colours_of(labels, OUTPUTS.colours))
    owners = range(32) if simplify else source.tolist()
    for line, (label, value) in enumerate(zip(lines, confidence, strict=True)):
        mine = [probabilities[face, label] for face, owner in enumerate(owners) if owner == line]
        assert (label == -1) == (not mine)
        assert value == pytest.approx(np.mean(mine) if mine else 0, abs=6e-5)
    assert found["counts"] == {name: lines.count(k) for k, name in enumerate(OUTPUTS.classes)}
    assert (found["unlabelled"], found["voting_rounds"], found["labelled"]) == (lines.count(-1), 2, "face")
    assert found["confidence"] == pytest.approx(np.mean(confidence, where=np.array(lines) >= 0), abs=1e-4)
    assert ("note" in found) == bool(simplify)
    assert found["files"] == [str(tmp_path / f"m.{ending}") for ending in ("ply", "seg", "confidence", "json")]


@pytest.mark.parametrize("steps", [(), ("weld",)])
def test_vertices_have_a_line_each_and_minus_one_without_features(tmp_path, steps):
    recipe = replace(PAPER, steps=steps)
    mesh = sample(1, vertex_source=np.arange(18, dtype="i4") if steps else None)
    probabilities, labels = drawn(18)
    labels[[3, 17]] = -1
    outputs = replace(OUTPUTS, task="vertex_segmentation", recipe=recipe, pictures=True)
    found, ply, lines, confidence = written(tmp_path, outputs, mesh, labels, probabilities)
    assert lines == labels.tolist() == np.array(ply["vertex"]["label"]).tolist()
    expected = np.where(labels < 0, 0, probabilities.max(axis=1))
    np.testing.assert_allclose(ply["vertex"]["confidence"], expected)
    np.testing.assert_allclose(confidence, expected, atol=6e-5)
    assert (found["labelled"], found["unlabelled"]) == ("vertex", 2)
    assert found["confidence"] == pytest.approx(expected[labels >= 0].mean())
    assert ("of the stored mesh" in found.get("note", "")) == bool(steps)
    assert (tmp_path / "m.png").read_bytes().startswith(b"\x89PNG")


def test_a_class_of_a_mesh_comes_with_all_probabilities(tmp_path):
    outputs = replace(OUTPUTS, task="classification", pictures=True)
    found = write_mesh(
        outputs, sample(1), np.array([2]), np.array([[0.25, 0.25, 0.5]]), Path("m.obj"), tmp_path / "deep/m"
    )
    assert found == {
        "source": "m.obj",
        "files": [str(tmp_path / "deep/m.json")],
        "class": "high",
        "probability": 0.5,
        "probabilities": {"low": 0.25, "middle": 0.25, "high": 0.5},
    }
    assert json.loads((tmp_path / "deep/m.json").read_text()) == found
    assert [path.name for path in (tmp_path / "deep").iterdir()] == ["m.json"]
