"""Shards of every version of the format that was ever written can be read, and hold what they held."""

import hashlib
import json
from pathlib import Path

import numpy as np
import pytest

from meshshard import open_dataset
from meshshard.sample import DIAGNOSTICS
from meshshard.schema import FIELDS
from meshshard.verify import verify

ARCHIVE = Path(__file__).parents[1] / "archive"
FOLDERS = sorted(path.parent for path in ARCHIVE.glob("format*/*/index.json"))
FULL, PLAIN = ARCHIVE / "format1" / "full", ARCHIVE / "format1" / "plain"


def by_id(folder):
    dataset = open_dataset(folder)
    return {dataset[number].id: dataset[number] for number in range(len(dataset))}


def value_of(sample, name):
    if name == "sample_digest":
        return sample.digest
    return sample.diagnostics[name] if name in DIAGNOSTICS else getattr(sample, name)


def test_the_archive_is_there():
    assert {folder.relative_to(ARCHIVE).as_posix() for folder in FOLDERS} >= {"format1/full", "format1/plain"}


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda folder: folder.name)
def test_archived_shards_are_whole(folder):
    assert verify(folder, full=True) == []


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda folder: folder.name)
def test_every_field_is_what_h5py_found_when_it_was_written(folder):
    expected = json.loads((folder.parent / "expected.json").read_text(encoding="utf-8"))[folder.name]
    samples = list(by_id(folder).values())
    for name, wanted in expected.items():
        if name in ("vertex_ptr", "face_ptr"):
            counts = [len(sample.vertices if name == "vertex_ptr" else sample.faces) for sample in samples]
            values = np.cumsum([0, *counts])
        elif name == "times":
            values = samples[0].times
        else:
            each = [value_of(sample, name) for sample in samples]
            if isinstance(wanted, list):
                assert each == wanted
                continue
            per_mesh = wanted["shape"][0] == len(samples)
            values = np.stack(each) if per_mesh else np.concatenate(each)
        found = np.ascontiguousarray(values, dtype=wanted["type"])
        assert list(found.shape) == wanted["shape"], name
        assert hashlib.sha256(found.tobytes()).hexdigest() == wanted["sha256"], name
    assert {field.name for field in FIELDS if field.required} <= set(expected)


def test_optional_fields_are_all_in_one_and_none_in_the_other():
    optional = {field.name for field in FIELDS if not field.required}
    for folder, there in ((FULL, optional), (PLAIN, set())):
        for sample in by_id(folder).values():
            assert {name for name in optional if getattr(sample, name) is not None} == there


def test_tables_of_the_data_sets():
    full, plain = open_dataset(FULL), open_dataset(PLAIN)
    assert (full.task, full.classes) == ("segmentation", ("eins", "zwei", "größe"))
    assert full.splits == {"test": (2,), "train": (0,), "val": (1,)}
    assert (full.recipe.name, full.recipe.spectrum, full.recipe.signed_dihedral) == ("full", 5, True)
    assert (plain.task, plain.classes, plain.ids) == ("unlabelled", (), ("sphere", "tetrahedron"))
    assert plain.recipe.name == "paper"
    np.testing.assert_allclose(plain[0].times, np.geomspace(0.01, 1, 16))
    assert (
        full.index.splits_sha256
        == hashlib.sha256(
            "closed/octahedron\ttrain\nclosed/tetrahedron\tval\nopen/größe\ttest\n".encode()
        ).hexdigest()
    )


@pytest.mark.parametrize(("name", "angle"), [("closed/octahedron", -1 / 3), ("closed/tetrahedron", 1 / 3)])
def test_solids_have_their_closed_forms(name, angle):
    """Both have vertices of area 2/sqrt(3) and edges of weight 1/sqrt(3): eigenvalues 0, 2 three times, then 3."""
    sample, area = by_id(FULL)[name], 2 / np.sqrt(3)
    vertices = len(sample.vertices)
    threes = vertices - 4
    np.testing.assert_allclose(sample.vertex_areas, area, rtol=1e-6)
    np.testing.assert_allclose(sample.dihedral, np.pi - np.arccos(angle), rtol=1e-6)
    np.testing.assert_allclose(sample.dihedral_signed, np.pi - np.arccos(angle), rtol=1e-6)
    hks = (1 + 3 * np.exp(-2 * sample.times) + threes * np.exp(-3 * sample.times)) / (vertices * area)
    np.testing.assert_allclose(sample.hks, np.tile(hks, (vertices, 1)), rtol=max(1e-6, sample.hks_error_bound))
    np.testing.assert_allclose(sample.eigenvalues, [0, 2, 2, 2, 3 if threes else np.nan], atol=1e-9)
    gram = area * sample.eigenvectors.T @ sample.eigenvectors
    np.testing.assert_allclose(gram, np.diag([1, 1, 1, 1, min(threes, 1)]), atol=1e-6)
    np.testing.assert_allclose(sample.vertex_normals, sample.vertices, atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(sample.vertices, axis=1), 1, rtol=1e-6)
    counts = {"components": 1, "cut_clusters": int(threes > 0)}
    assert sample.diagnostics == dict.fromkeys(DIAGNOSTICS, 0) | counts
    assert (sample.face_adjacency >= 0).all()


def test_names_labels_and_places():
    samples = by_id(FULL)
    tetrahedron = samples["closed/tetrahedron"]
    np.testing.assert_allclose(tetrahedron.centre, [10, 20, 30], atol=1e-12)
    assert tetrahedron.scale == pytest.approx(2 * np.sqrt(3))
    np.testing.assert_allclose(tetrahedron.original_vertices[0], [12, 22, 32], rtol=1e-6)
    assert tetrahedron.faces.tolist() == [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]]
    assert tetrahedron.face_adjacency.tolist() == [[1, 3, 2], [2, 3, 0], [0, 3, 1], [1, 2, 0]]
    assert tetrahedron.face_labels.tolist() == [-1, 0, 1, 2]
    assert tetrahedron.vertex_labels.tolist() == [0, 1, 2, 0]
    assert (tetrahedron.mesh_label, tetrahedron.split, tetrahedron.group) == (1, "val", "closed")
    assert [sample.mesh_label for sample in samples.values()] == [0, 1, 2]
    assert [sample.source for sample in samples.values()] == [f"{name}.obj" for name in samples]
    assert tetrahedron.key == hashlib.sha256(b"key closed/tetrahedron").hexdigest()
    assert {sample.mesh_label for sample in by_id(PLAIN).values()} == {-1}


def test_the_broken_square_is_told_as_broken():
    square = by_id(FULL)["open/größe"]
    assert square.diagnostics == dict.fromkeys(DIAGNOSTICS, 0) | {
        "unreferenced_vertices": 1,
        "welded_vertices": 2,
        "degenerate_faces": 1,
        "boundary_edges": 4,
        "components": 1,
        "undefined_normals": 1,
    }
    np.testing.assert_array_equal(square.vertex_normals, [[0, 0, 1]] * 6 + [[0, 0, 0]])
    np.testing.assert_array_equal(square.dihedral, 0)
    np.testing.assert_array_equal(square.used_vertices, [True] * 6 + [False])
    np.testing.assert_array_equal(square.hks[0], square.hks[3])
    assert square.face_source.tolist() == [0, 1, 2]
    assert (square.face_areas * square.scale**2).tolist() == pytest.approx([0.5, 0.5, 0])
    assert np.isnan(square.eigenvalues[4])
