import re
from base64 import b64decode
from dataclasses import replace

import numpy as np
import pytest
from html_pages import HOSTILE, TAGS, Page
from samples import sample, toy_dataset, write_dataset

from meshshard import open_dataset
from meshshard.data_card.card import data_card
from meshshard.data_card.examples import examples
from meshshard.data_card.page import card_page, colours_for, histogram
from meshshard.data_card.survey import survey
from meshshard.data_card.tables import tables
from meshshard.index import Rejection, read_index


def page_of(folder):
    dataset = open_dataset(folder)
    seen = survey(dataset)
    card = data_card(dataset, seen)
    return card_page(dataset, seen, card), card


def groups_of(folder):
    dataset = open_dataset(folder)
    return dataset, {group.title: group.examples for group in examples(dataset, survey(dataset))}


def test_the_page_shows_the_tables(tmp_path):
    mesh = sample(0)
    mesh.diagnostics["boundary_edges"] = 3
    folder = write_dataset(tmp_path, [mesh, sample(1)], ["train", "test"])
    bad = Rejection(id=HOSTILE, source="s", code=HOSTILE, message="m", key="k")
    replace(read_index(folder), refused=(bad,)).write(folder)
    text, card = page_of(folder)
    assert list(tables(card)) == ["facts", "sizes", "classes", "diagnostics", "rejected", "origin"]
    expected = [list(row) for table in tables(card).values() for row in (table.header, *table.rows) if row]
    assert sorted(Page(text).rows) == sorted(expected)


def test_the_page_needs_nothing_else_and_every_picture_has_a_text(tmp_path):
    text, _ = page_of(toy_dataset(tmp_path))
    page = Page(text)
    for word in ("http:", "https:", "//", "url(", "@import", "<link", "<script"):
        assert word not in re.sub(r"base64,[^\"]+", "", text), word
    images = page.named("img")
    assert len(images) > 10
    for image in images:
        kind, data = image["src"].split(",")
        assert kind == "data:image/png;base64"
        assert b64decode(data).startswith(b"\x89PNG")
        assert re.fullmatch(r"mesh mesh\d{3}, [\d,]+ faces, (train|val|test)", image["alt"])
    assert "prefers-color-scheme: dark" in text
    assert "@media print" in text
    assert page.named("html") == [{"lang": "en"}]
    assert 100 * len(text) / len(images) < 5e6


def test_names_are_hostile(tmp_path):
    samples = [sample(n, id=f"{HOSTILE}{n}\x1b[2J", label_rule=HOSTILE) for n in range(3)]
    classes = (HOSTILE, HOSTILE.upper(), "high")
    folder = write_dataset(tmp_path, samples, [HOSTILE, "train", "test"], classes=classes)
    index = read_index(folder)
    replace(index, dataset=HOSTILE, notes=(HOSTILE,), licence=HOSTILE, citation=HOSTILE, split_rule=HOSTILE).write(
        folder
    )
    text, _ = page_of(folder)
    page = Page(text)
    assert {tag for tag, _ in page.tags} <= TAGS
    assert not [name for _, attributes in page.tags for name in attributes if name.startswith("on")]
    assert all(image["src"].startswith("data:") for image in page.named("img"))
    assert ["licence", HOSTILE] in page.rows
    assert HOSTILE in page.text
    assert "\x1b" not in text
    assert "\N{REPLACEMENT CHARACTER}[2J" in text


def test_a_data_set_of_parts_shows_its_splits_and_classes(tmp_path):
    dataset, groups = groups_of(toy_dataset(tmp_path))
    for split, count in (("train", 8), ("val", 3), ("test", 3)):
        assert [example.number for example in groups[f"Split {split}"]] == sorted(dataset.splits[split])[:count]
    for example in groups["Where each class has its largest share"]:
        label = dataset.classes.index(example.caption)
        shares = [(mesh.face_labels == label).mean() for mesh in dataset]
        assert shares[example.number] == max(shares)
    assert [len(dataset[example.number].faces) for example in groups["Smallest and largest"]] == [8, 128]


def test_meshes_of_one_size_are_neither_smallest_nor_largest(tmp_path):
    folder = write_dataset(tmp_path, [sample(1), sample(2)], ["train", "test"])
    _, groups = groups_of(folder)
    assert "Smallest and largest" not in groups
    assert "in every one" in page_of(folder)[0]


def test_a_data_set_of_whole_meshes_shows_its_classes(tmp_path):
    samples = [sample(n, labels=None, mesh_label=n % 2) for n in range(12)]
    folder = write_dataset(tmp_path, samples, ["train"] * 12, task="classification", classes=("even", "odd", "none"))
    dataset, groups = groups_of(folder)
    shown = [(example.caption, dataset[example.number].mesh_label) for example in groups["Classes"]]
    assert shown == [("even", 0)] * 3 + [("odd", 1)] * 3
    many = tuple(f"class {n}" for n in range(80))
    folder = write_dataset(
        tmp_path / "many", [sample(n, labels=None, mesh_label=n) for n in range(80)], [""] * 80, classes=many
    )
    _, groups = groups_of(folder)
    assert len(groups["Classes (20 more are not shown)"]) == 60


def test_the_worst_mesh_of_each_diagnostic_is_shown(tmp_path):
    samples = [sample(n) for n in range(5)]
    samples[3].diagnostics["boundary_edges"], samples[1].diagnostics["boundary_edges"] = 1200, 7
    samples[2].diagnostics["components"] = 2
    for mesh in (samples[0], samples[1]):
        mesh.diagnostics["components"] = 1
    _, groups = groups_of(write_dataset(tmp_path, samples, ["train"] * 5))
    worst = [(example.number, example.caption) for example in groups["Most of each diagnostic"]]
    assert worst == [(3, "boundary_edges: 1,200"), (2, "components: 2")]


def test_what_colours_a_mesh():
    own = ("#010203", "#040506", "#070809")
    mesh = sample(0)
    assert set(map(tuple, colours_for(mesh, own).tolist())) <= {(1, 2, 3), (4, 5, 6), (7, 8, 9)}
    whole = sample(0, labels=None, mesh_label=1)
    assert np.unique(colours_for(whole, own), axis=0).tolist() == [[4, 5, 6]]
    vertex_labels = np.arange(len(mesh.vertices)).astype("i2") % 3
    corners = colours_for(sample(0, labels=None, vertex_labels=vertex_labels), own)
    assert (
        corners[0, 1].tolist()
        == np.array([[1, 2, 3], [4, 5, 6], [7, 8, 9]])[vertex_labels[mesh.faces[0, 1]]].tolist()
    )
    flat = sample(0, labels=None, dihedral=np.zeros(len(mesh.vertices), dtype="f4"))
    assert np.unique(colours_for(flat, ()).reshape(-1, 3), axis=0).tolist() == [[0x44, 0x01, 0x54]]


def test_an_unlabelled_and_an_empty_data_set_have_pages(tmp_path):
    folder = write_dataset(
        tmp_path, [sample(n, labels=None) for n in range(2)], [""] * 2, task="unlabelled", classes=()
    )
    text, _ = page_of(folder)
    assert "In no split" in text
    assert "linear-gradient" in text
    replace(read_index(folder), shards=(), ids=(), keys=(), splits=()).write(folder)
    text, _ = page_of(folder)
    assert not Page(text).named("img")


@pytest.mark.parametrize(
    "counts", [[5, 5, 9], list(range(1, 60)), [1, 1000], [10, 10**6, 999], list(range(500, 800, 7)), [3, 4]]
)
def test_bars_hold_every_mesh_once(counts):
    chart = histogram(np.array(counts), "faces")
    assert sum(int(bar["text"].split(": ")[1].split()[0].replace(",", "")) for bar in chart["bars"]) == len(counts)
    for bar in chart["bars"]:
        least, most = (int(word.replace(",", "")) for word in re.findall(r"[\d,]+", bar["text"])[:2])
        number = sum(least <= count <= most for count in counts)
        assert f"{number:,} meshes" in bar["text"]
        assert float(bar["y"]) + float(bar["height"]) == pytest.approx(100, abs=0.01)
    assert max(float(bar["height"]) for bar in chart["bars"]) == 100
    assert chart["ends"] == (f"{min(counts):,}", f"{max(counts):,}")


def test_equal_sizes_need_no_bars():
    chart = histogram(np.array([1500] * 7), "faces")
    assert (chart["bars"], chart["ends"][0]) == ([], "1,500")
