import json
from dataclasses import replace

import numpy as np
import pytest
from samples import sample, toy_dataset, write_dataset
from shapes import FAMILY, box, sphere

from meshshard import open_dataset
from meshshard.data_card.card import data_card, recipe_words
from meshshard.data_card.survey import survey
from meshshard.data_card.tables import tables
from meshshard.index import Rejection, read_index
from meshshard.plain import to_json
from meshshard.recipe import RECIPES, Recipe
from meshshard.sample import DIAGNOSTICS
from meshshard_prep import compute_features

SIDES = np.repeat([0, 0, 1, 1, 2, 2], 2).astype("i2")
"""Classes of a box's faces: across x, y, z."""

BOXES = [(1.0, 2.0, 3.0), (2.0, 0.5, 0.7), (1.0, 1.0, 1.0), (0.2, 4.0, 1.0)]


def made(vertices, faces, name, **fields):
    """A sample of a mesh with real features."""
    return replace(compute_features(vertices, faces, recipe="paper"), id=name, key=f"{name:0>64}", **fields)


def card_of(folder):
    dataset = open_dataset(folder)
    return data_card(dataset, survey(dataset))


def rows_of(card, part):
    return {name: cells for name, *cells in tables(card)[part].rows}


def test_areas_of_boxes(tmp_path):
    """Sides across x have 2bc of the surface; a box is divided by half its diagonal."""
    samples = [made(*box(*sides), f"m{n}", face_labels=SIDES) for n, sides in enumerate(BOXES)]
    card = card_of(write_dataset(tmp_path, samples, ["train", "train", "test", "test"], classes=("x", "y", "z")))
    for split, some in (("train", BOXES[:2]), ("test", BOXES[2:])):
        areas = sum(np.array([2 * b * c, 2 * a * c, 2 * a * b]) / ((a * a + b * b + c * c) / 4) for a, b, c in some)
        found = card["splits"][split]["classes"]
        assert [row["area_share"] for row in found] == pytest.approx(areas / areas.sum(), rel=1e-6)
        assert [row["count_share"] for row in found] == pytest.approx([1 / 3] * 3)
        assert [row["count"] for row in found] == [8, 8, 8]
        assert [row["meshes"] for row in found] == [2, 2, 2]
    assert card["labelled"] == {"faces": 4}
    assert card["all"]["missing"] == []


def test_unlabelled_faces_and_missing_classes(tmp_path):
    ends = np.where(SIDES == 0, 0, -1).astype("i2")  # only the sides across x
    samples = [made(*box(*BOXES[0]), "a", face_labels=SIDES), made(*box(*BOXES[1]), "b", face_labels=ends)]
    card = card_of(write_dataset(tmp_path, samples, ["train", "test"], classes=("x", "y", "z", "w")))
    train, test = card["splits"]["train"], card["splits"]["test"]
    assert (train["missing"], test["missing"], card["all"]["missing"]) == (["w"], ["y", "z", "w"], ["w"])
    assert (train["unlabelled"], test["unlabelled"], card["all"]["unlabelled"]) == (0, 8, 8)
    assert [row["count"] for row in card["all"]["classes"]] == [8, 4, 4, 0]
    assert test["classes"][0]["area_share"] == test["classes"][0]["count_share"] == 1
    assert rows_of(card, "classes")["w"] == ["missing", "-", "missing", "missing"]
    assert rows_of(card, "classes")["unlabelled faces"] == ["0", "0", "8", "8"]


def test_labels_of_vertices_count_vertices_and_their_areas(tmp_path):
    """The six corners of an octahedron have equal areas."""
    labels = np.array([0, 0, 0, 0, 1, -1], dtype="i2")
    card = card_of(write_dataset(tmp_path, [made(*sphere(0), "a", vertex_labels=labels)], [""], classes=("p", "q")))
    assert card["labelled"] == {"vertices": 1}
    assert list(card["splits"]) == [""]
    for share in ("count_share", "area_share"):
        assert [row[share] for row in card["all"]["classes"]] == pytest.approx([0.8, 0.2], rel=1e-6)
    assert card["all"]["unlabelled"] == 1
    assert tables(card)["classes"].title == "Classes: share of vertices, of area, in %"
    assert tables(card)["sizes"].header == ("", "(no split)")


def test_classification_counts_meshes(tmp_path):
    samples = [sample(n, labels=None, mesh_label=label, label_domain="mesh") for n, label in enumerate([0, 0, 2, -1])]
    folder = write_dataset(tmp_path, samples, ["train"] * 3 + ["test"], task="classification")
    card = card_of(folder)
    assert card["labelled"] == {"meshes": 4}
    assert card["label_domains"] == {"mesh": 4}
    assert ("labels", "of the whole mesh in 4 meshes") in tables(card)["facts"].rows
    assert [row["count"] for row in card["splits"]["train"]["classes"]] == [2, 0, 1]
    assert {row["area_share"] for row in card["all"]["classes"]} == {None}
    assert (card["all"]["unlabelled"], card["splits"]["test"]["missing"]) == (1, ["low", "middle", "high"])
    assert rows_of(card, "classes")["low"] == ["66.7", "-", "missing", "66.7"]


def test_sizes_and_diagnostics_of_families(tmp_path):
    samples = {name: made(vertices, faces, name) for name, (vertices, faces) in FAMILY.items()}
    folder = write_dataset(tmp_path, samples.values(), ["train"] * len(samples), task="unlabelled", classes=())
    part = card_of(folder)["splits"]["train"]
    counts = [len(faces) for _, faces in FAMILY.values()]
    assert part["faces"] == {
        "sum": sum(counts),
        "least": min(counts),
        "median": np.median(counts),
        "most": max(counts),
    }
    assert part["vertices"]["sum"] == sum(len(vertices) for vertices, _ in FAMILY.values())
    found = part["diagnostics"]
    assert found["components"] == {"sum": 3, "meshes": 1}  # of `pieces`: the others are one piece each
    assert found["nonmanifold_edges"] == {"sum": 1, "meshes": 1}
    assert found["boundary_edges"] == {"sum": 2 * (5 + 4) + 2 * (2 + 2) + 2, "meshes": 3}  # sheet, pieces, fin
    bounds = [s.hks_error_bound for s in samples.values()]
    assert part["hks_error_bound"] == {"median": pytest.approx(np.median(bounds)), "largest": max(bounds)}
    card = card_of(folder)
    assert set(found) == set(DIAGNOSTICS)
    assert (card["labelled"], card["classes"], card["all"]["unlabelled"]) == ({}, [], 0)
    assert "classes" not in tables(card)
    assert rows_of(card, "diagnostics")["nonmanifold_edges"] == ["1 in 1", "-", "-", "1 in 1"]


def test_what_the_index_says(tmp_path):
    folder = toy_dataset(tmp_path)
    index = read_index(folder)
    bad = [Rejection(id=f"r{n}", source="s", code=code, message="m", key="k") for n, code in enumerate("aab")]
    replace(
        index,
        licence="CC BY 4.0",
        citation="Somebody 2020",
        notes=("one mesh is missing",),
        colours=("#010203", "#040506", "#070809"),
        refused=tuple(bad),
        failed=(bad[0],),
        split_rule="drawn",
        train_fraction=0.1,
    ).write(folder)
    card = card_of(folder)
    assert (card["refused"], card["failed"]) == (
        {"meshes": 3, "codes": {"a": 2, "b": 1}},
        {"meshes": 1, "codes": {"a": 1}},
    )
    assert tables(card)["rejected"].rows == (("refused", "a", "2"), ("refused", "b", "1"), ("failed", "a", "1"))
    assert card["colours"] == ["#010203", "#040506", "#070809"]
    facts = tables(card)["facts"].rows
    for row in (("licence", "CC BY 4.0"), ("cite", "Somebody 2020"), ("note", "one mesh is missing")):
        assert row in facts
    origin = dict(tables(card)["origin"].rows)
    assert origin["splits"] == "drawn; seed 0; 0.1 of train kept"
    assert origin["on disk"] == f"{(folder / 'shard-0.h5').stat().st_size:,} bytes, shards: 1"
    assert (origin["content_sha256"], origin["splits_sha256"]) == (index.content_sha256, index.splits_sha256)


def test_an_empty_data_set_and_an_empty_split(tmp_path):
    folder = write_dataset(tmp_path / "some", [sample(0)], ["test"])
    sizes = rows_of(card_of(folder), "sizes")
    assert tables(card_of(folder))["sizes"].header == ("", "train", "val", "test", "all")
    assert sizes["meshes"] == ["0", "0", "1", "1"]
    assert sizes["faces of a mesh, median"] == ["-", "-", "32", "32"]
    nothing = replace(read_index(folder), shards=(), ids=(), keys=(), splits=())
    (tmp_path / "none").mkdir()
    nothing.write(tmp_path / "none")
    card = card_of(tmp_path / "none")
    assert (card["meshes"], card["splits"], card["all"]["faces"]["sum"]) == (0, {}, 0)
    assert rows_of(card, "classes") == {name: ["-"] for name in ("low", "middle", "high")}


def test_label_rules_are_told(tmp_path):
    samples = [sample(n, label_domain="edge", label_rule="majority of edges") for n in range(2)]
    facts = tables(card_of(write_dataset(tmp_path, samples, ["train"] * 2)))["facts"].rows
    assert ("labels", "of edges in 2 meshes") in facts
    assert ("labels converted", "majority of edges (2 meshes)") in facts


def test_tables_show_the_numbers_of_the_json(tmp_path):
    card = json.loads(to_json(card_of(toy_dataset(tmp_path))))
    sizes, classes = rows_of(card, "sizes"), rows_of(card, "classes")
    for column, part in enumerate([*card["splits"].values(), card["all"]]):
        for what in ("vertices", "faces"):
            assert sizes[what][column] == f"{part[what]['sum']:,}"
            assert sizes[f"{what} of a mesh, most"][column] == f"{part[what]['most']:,}"
        for row in part["classes"]:
            shares = f"{100 * row['count_share']:.1f}, {100 * row['area_share']:.1f}"
            assert classes[row["name"]][column] == shares
    assert card["all"]["faces"]["sum"] == sum(part["faces"]["sum"] for part in card["splits"].values())


def test_a_recipe_in_words():
    assert recipe_words(RECIPES["paper"]).endswith("pieces kept separate; mesh stored as in its file")
    said = recipe_words(
        Recipe(
            name="x",
            laplacian="cotangent",
            regularisation=1e-8,
            components="bridged",
            times=(0.5,),
            steps=("weld", "orient"),
            simplify=750,
            spectrum=8,
            signed_dihedral=True,
            official_dihedral=True,
        )
    )
    for words in (
        "cotangent Laplacian plus 1e-08 times the identity",
        "at 1 times from 0.5 to 0.5",
        "joined by weak links",
        "mesh changed by: weld, orient",
        "simplified to 750 faces",
        "8 eigenpairs",
        "signed dihedral",
        "published code",
    ):
        assert words in said
