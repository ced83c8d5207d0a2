"""From files to stored samples, with steps."""

import hashlib
import json

import numpy as np
import pytest
from prepared import raw_mesh, soup
from program import meshshard
from shapes import FAMILY, box, bumpy, joined, sphere, write_labels, write_obj
from told import but_progress

from meshshard import open_dataset
from meshshard.recipe import STEPS, Recipe
from meshshard.verify import verify
from meshshard_prep import compute_features
from meshshard_prep.datasets.layout import Entry, LabelFile
from meshshard_prep.doctor import diagnose, entries_at
from meshshard_prep.doctor_report import rows
from meshshard_prep.labels import Labels
from meshshard_prep.pipeline import compute_sample
from meshshard_prep.prepare import steps
from meshshard_prep.prepare.steps import prepare

ALL = Recipe(name="all", steps=STEPS, simplify=40)


def test_every_step_of_a_recipe_has_code():
    assert tuple(steps.STEPS) == STEPS


@pytest.mark.parametrize("name", FAMILY)
def test_without_steps_the_mesh_is_handed_on(name):
    raw, labels = raw_mesh(*FAMILY[name]), Labels(domain="face")
    prepared = prepare(raw, labels, Recipe(name="plain"))
    assert prepared.mesh is raw
    assert prepared.labels is labels
    assert (prepared.vertex_source, prepared.counts) == (None, {})
    assert compute_features(*FAMILY[name]).vertex_source is None


@pytest.mark.parametrize("name", FAMILY)
def test_all_steps_on_every_shape(name):
    """The arrays of a raw mesh cannot be written to: this would raise if a step did."""
    vertices, faces = soup(*FAMILY[name])
    prepared = prepare(raw_mesh(vertices, faces), None, ALL)
    sample = compute_features(vertices, faces, ALL)
    np.testing.assert_array_equal(sample.faces, prepared.mesh.faces)
    np.testing.assert_array_equal(sample.vertex_source, prepared.vertex_source)
    assert sample.vertex_source.max() < len(vertices)
    assert sample.face_source.max() < sample.polygons == len(faces)
    counts = sample.diagnostics
    assert counts["faces_before"] == len(faces) - counts["dropped_faces"]
    assert (counts["components"], counts["welded_vertices"]) == (1, 0)


def test_steps_are_taken_in_the_order_of_the_recipe():
    """The pieces are inside out: turned before or after the smaller is dropped, by count."""
    vertices, faces = joined(box(2, 2, 2), box())
    recipes = [Recipe(name="a", steps=("orient", "largest_component"))]
    recipes += [Recipe(name="b", steps=recipes[0].steps[::-1])]
    first, second = (prepare(raw_mesh(vertices, faces[:, ::-1]), None, recipe).counts for recipe in recipes)
    assert first == {"turned_faces": 24, "dropped_faces": 12}
    assert second == {"turned_faces": 12, "dropped_faces": 12}


def entry_of(tmp_path, text, **file):
    (tmp_path / "a.obj").write_text(text)
    labels = LabelFile(path=tmp_path / "a.seg", classes={7: 0, 8: 1, 9: 2}, **file)
    return Entry(id="a", path=tmp_path / "a.obj", source="a.obj", labels=labels)


def quads(tmp_path):
    """A triangle, a large and a small quadrilateral, apart from each other; a label for each."""
    corners = [(0, 0), (1, 0), (0, 1), (10, 0), (15, 0), (15, 5), (10, 5), (20, 0), (21, 0), (21, 1), (20, 1)]
    lines = [f"v {x} {y} 0" for x, y in corners] + ["f 1 2 3", "f 4 5 6 7", "f 8 9 10 11", ""]
    return entry_of(tmp_path, "\n".join(lines), domains=("face",))


def test_labels_of_polygons_go_to_the_triangles_that_are_kept(tmp_path):
    entry = quads(tmp_path)
    recipe = Recipe(name="largest", steps=("largest_component",))
    sample = compute_sample(entry, entry.path.read_bytes(), b"7\n8\n9\n", None, recipe)
    assert sample.face_labels.tolist() == [1, 1]
    assert sample.face_source.tolist() == [1, 1]
    assert sample.vertex_source.tolist() == [3, 4, 5, 6]
    assert (sample.polygons, sample.label_domain, sample.label_rule) == (3, "face", "")


def test_labels_of_edges_are_counted_before_faces_are_turned(tmp_path):
    vertices, faces = sphere(2)
    write_obj(tmp_path / "a.obj", vertices, faces)
    entry = entry_of(tmp_path, (tmp_path / "a.obj").read_text(), domains=("edge",))
    plain, turned = (
        compute_sample(entry, entry.path.read_bytes(), b"7\n" * 96 + b"8\n" * 96, None, recipe)
        for recipe in (Recipe(name="plain"), Recipe(name="turned", steps=("orient",)))
    )
    np.testing.assert_array_equal(turned.face_labels, plain.face_labels)
    assert set(plain.face_labels) == {0, 1}


@pytest.fixture(scope="module")
def world(tmp_path_factory):
    """A folder of labelled meshes, what its files hold, and its features by all steps, from one and two workers."""
    root = tmp_path_factory.mktemp("world")
    for number in range(5):
        vertices, faces = joined(bumpy(number, 2), sphere(0))
        write_obj(root / "raw" / f"m{number}.obj", *soup(vertices, faces[:, ::-1]))
        write_labels(root / "raw" / f"m{number}.seg", vertices[faces].mean(axis=1)[:, 1] > 0)
    before = hashes(root / "raw")
    options = [word for step in STEPS for word in ("--step", step)] + ["--simplify", 60]
    for jobs in (1, 2):
        status, _, error = meshshard("features", "raw", *options, "--out", f"out{jobs}", "--jobs", jobs, cwd=root)
        assert (status, but_progress(error)) == (0, "")
    return root, options, before


def hashes(folder):
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in folder.glob("[!.]*")}


def test_raw_files_are_never_written(world):
    root, _, before = world
    assert hashes(root / "raw") == before


def test_the_same_bytes_for_any_number_of_workers(world):
    root, _, _ = world
    assert hashes(root / "out1") == hashes(root / "out2")


def test_what_is_stored_by_all_steps(world):
    root, _, _ = world
    dataset = open_dataset(root / "out1")
    assert verify(root / "out1", full=True) == []
    assert dataset.recipe.name == "paper-weld-largest_component-orient-simplify60"
    for sample in dataset:
        counts = sample.diagnostics
        assert sample.faces.shape == (60, 3)
        assert (counts["dropped_faces"], counts["turned_faces"], counts["faces_before"]) == (8, 128, 128)
        assert counts["merged_vertices"] == 3 * 136 - 66 - 6
        assert 0 < counts["ambiguous_faces"] < 40
        assert sample.label_rule == "carried to the simplified mesh by the majority of area"
        height = sample.original_vertices[sample.faces][:, :, 1]
        assert sample.face_labels[(height > 0.3).all(axis=1)].all()
        assert not sample.face_labels[(height < -0.3).all(axis=1)].any()


def test_status_knows_them_again(world):
    root, options, _ = world
    for words in (["raw", *options, "--out", "out1"], ["out1", "--raw", "raw"]):
        table = json.loads(meshshard("status", *words, "--json", cwd=root)[1])
        assert (table["plan"]["fresh"], table["plan"]["stale_or_missing"]) == (5, 0)


def test_doctor_tells_what_is_prepared(world):
    (entry,) = entries_at(world[0] / "raw" / "m0.obj")
    mesh = diagnose(entry, ALL)
    assert mesh.refusal is None
    assert (mesh.found["triangles"], mesh.found["prepared"]["triangles"]) == (136, 40)
    assert (mesh.found["piece_faces"], mesh.found["counts"]["merged_vertices"]) == ((40,), 336)
    assert dict(rows(mesh))["prepared"].endswith("vertices, 40 triangles")
    assert "prepared" not in dict(rows(diagnose(entry, Recipe(name="plain"))))


def test_what_is_no_step_is_told(world):
    status, _, error = meshshard("features", "raw", "--step", "smooth", "--out", "none", cwd=world[0])
    assert status == 2
    assert "steps are some of weld, largest_component, orient, each once" in error
