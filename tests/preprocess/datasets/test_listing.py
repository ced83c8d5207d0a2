"""`meshshard datasets`: every name once, by task, with the published counts for programs."""

import json

import typer
from typer.testing import CliRunner

from meshshard_prep.commands import datasets
from meshshard_prep.datasets import ADAPTERS
from meshshard_prep.datasets.listing import INDENT, WIDTH, as_text


def listed(*options):
    app = typer.Typer()
    app.command()(datasets)
    result = CliRunner().invoke(app, list(options))
    assert result.exit_code == 0
    return result.output


def test_every_name_is_listed_once_below_its_task():
    text = listed()
    assert text.strip() == as_text(list(ADAPTERS.values()))
    task, found = "", []
    for line in text.splitlines():
        assert len(line) <= WIDTH
        if line.isupper():
            task = line.lower()
        elif line[:1].strip():  # names begin a line, all else is indented
            names = line.split(", ") if "," in line[:INDENT] else [line[:INDENT].strip()]
            found += [(name.strip(" ,"), task) for name in names]
    assert sorted(found) == sorted((name, adapter.task) for name, adapter in ADAPTERS.items())


def test_it_says_what_can_be_fetched():
    text = as_text([ADAPTERS["shrec11_dense_split10"], ADAPTERS["minicoseg"]])
    assert text.count("meshshard fetch shrec11_dense_split10") == 1
    assert "meshshard fetch minicoseg" not in text


def test_what_comes_from_one_place_has_one_licence():
    assert as_text([ADAPTERS["shrec11_split16"], ADAPTERS["shrec11_split10"]]).count("licence: ") == 1
    assert as_text([ADAPTERS["shrec_16"], ADAPTERS["cubes"]]).count("licence: ") == 2


def test_json_has_the_published_counts():
    table = json.loads(listed("--json"))
    assert set(table) == set(ADAPTERS)
    assert table["human_seg"]["expected"] == {"train": 381, "test": 18}
    assert table["intra"]["expected"] == {"meshes": 116}
    assert table["shrec11_split10"] | {"citation": ""} == {
        "task": "classification",
        "summary": "SHREC11, 30 classes, 10 + 10 meshes each drawn by --split-seed, 500 faces",
        "expected": {"meshes": 600, "classes": 30},
        "licence": "research only; no licence stated",
        "citation": "",
        "origin": "the shrec_16 archive that MeshCNN's scripts/shrec/get_data.sh loads",
        "folder": "data/raw/shrec_16",
        "fetch": True,
        "page": "docs/datasets/shrec11.md",
    }
