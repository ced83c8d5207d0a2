"""FAUST and SCAPE: registered meshes are their own correspondence, remeshed ones come with .vts files."""

from collections import Counter

import numpy as np
import pytest
from light import LIGHT
from shapes import bumpy, tetrahedron, write_labels, write_off, write_ply

from meshshard import open_dataset
from meshshard.errors import UsageError
from meshshard_prep.datasets import read_dataset
from meshshard_prep.datasets.faust_scape import NAMES, template_size
from meshshard_prep.run import run

SMALL = tetrahedron()


@pytest.fixture(scope="module")
def registered(tmp_path_factory):
    """MPI-FAUST and SCAPE with all their folders; scans are no registrations."""
    root = tmp_path_factory.mktemp("registered")
    for number in range(100):
        write_ply(root / "faust" / "training" / "registrations" / f"tr_reg_{number:03}.ply", *SMALL)
        write_ply(root / "faust" / "training" / "scans" / f"tr_scan_{number:03}.ply", *SMALL)
    for number in range(72):
        if number != 51:
            write_ply(root / "scape" / f"mesh{number:03}.ply", *SMALL)
    return root


@pytest.fixture(scope="module")
def remeshed(tmp_path_factory):
    root = tmp_path_factory.mktemp("remeshed")
    for kind, names in NAMES.items():
        for name in names:
            write_off(root / kind / "off" / f"{name}.off", *SMALL)
            write_labels(root / kind / "corres" / f"{name}.vts", [4, 3, 2, 1, 1])
    return root


@pytest.mark.parametrize("form", ["", "_r"])
@pytest.mark.parametrize(("kind", "train", "meshes"), [("faust", 80, 100), ("scape", 51, 71)])
def test_the_whole_of_it(request, kind, form, train, meshes):
    root = request.getfixturevalue("remeshed" if form else "registered") / kind
    dataset = read_dataset(kind + form, root)
    assert (dataset.task, dataset.classes, dataset.notes) == ("correspondence", (), ())
    assert Counter(entry.split for entry in dataset.entries) == {"train": train, "test": 20}
    assert [entry.id for entry in dataset.entries] == list(NAMES[kind])
    assert [entry.split for entry in dataset.entries] == ["train"] * train + ["test"] * 20
    assert len(dataset.entries) == meshes
    assert {entry.template for entry in dataset.entries} == {5 if form else 6890 if kind == "faust" else 12500}


def test_people_of_faust_are_groups_and_test_holds_two_of_them(registered):
    entries = read_dataset("faust", registered / "faust").entries
    assert Counter(entry.group for entry in entries) == {f"subject {n}": 10 for n in range(10)}
    assert {entry.group for entry in entries if entry.split == "test"} == {"subject 8", "subject 9"}


def test_a_missing_mesh_does_not_move_the_others_between_splits(tmp_path):
    for number in (0, 50, 52, 71):
        write_ply(tmp_path / f"mesh{number:03}.ply", *SMALL)
    write_ply(tmp_path / "mesh051.ply", *SMALL)
    dataset = read_dataset("scape", tmp_path)
    assert [(e.id, e.split) for e in dataset.entries] == [
        ("mesh000", "train"),
        ("mesh050", "train"),
        ("mesh052", "test"),
        ("mesh071", "test"),
    ]
    assert dataset.notes[0].startswith("missing meshes: mesh001, mesh002")
    assert dataset.notes[1] == "mesh051 is not one of scape, and was not read"


@pytest.mark.parametrize("folders", [("off", "corres"), ("off_2", "corrs"), ("shapes", "correspondences")])
def test_remeshed_points_that_correspond_are_the_same(tmp_path, folders):
    vertices, faces = bumpy(1)
    for name in ("tr_reg_000", "tr_reg_099"):
        order = np.random.default_rng(int(name[-2:])).permutation(len(vertices))
        place = np.argsort(order)
        write_off(tmp_path / "raw" / folders[0] / f"{name}.off", vertices[order], place[faces])
        write_labels(tmp_path / "raw" / folders[1] / f"{name}.vts", place[:40] + 1)
    report = run(read_dataset("faust_r", tmp_path / "raw"), tmp_path / "out", LIGHT, jobs=1)
    assert report.ok
    first, last = open_dataset(tmp_path / "out")
    np.testing.assert_allclose(first.vertices[first.correspondence], last.vertices[last.correspondence], atol=1e-6)
    assert report.index.task == "correspondence"
    assert report.index.splits == ("train", "test")


def test_a_registered_mesh_with_other_vertices_is_refused(registered, tmp_path):
    report = run(read_dataset("scape", registered / "scape"), tmp_path / "out", LIGHT, jobs=1)
    assert {entry.code for entry in report.index.refused} == {"correspondence-count"}
    assert "template has 12500 vertices" in report.index.refused[0].message


def test_the_template_has_as_many_vertices_as_most_files_have_lines(tmp_path):
    for name, lines in (("a", 4), ("b", 5), ("c", 5)):
        write_labels(tmp_path / name, [1] * lines)
    assert template_size(tmp_path / name for name in "abcd") == 5
    assert template_size([]) == 0


@pytest.mark.parametrize("name", ["faust", "scape", "faust_r", "scape_r"])
def test_another_layout_is_refused(tmp_path, name):
    write_off(tmp_path / "bodies" / "tr_reg_000.off", *SMALL)
    with pytest.raises(UsageError, match=f"not in the layout of {name}"):
        read_dataset(name, tmp_path)
