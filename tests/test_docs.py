"""What the documents promise is so."""

import json
import re
import subprocess
import sys
import tomllib
from dataclasses import fields
from importlib.metadata import PackageNotFoundError, distribution, entry_points, metadata
from pathlib import Path

import h5py
import pytest
import typer
from samples import toy_dataset
from shapes import box, write_labels, write_obj
from typer.testing import CliRunner

from meshshard import open_dataset
from meshshard.cli import VERBS, app
from meshshard.data_card.card import data_card
from meshshard.data_card.survey import survey
from meshshard.errors import FAILURES, REFUSALS
from meshshard.recipe import RECIPES as RECIPES_OF_FEATURES
from meshshard.recipe import Recipe
from meshshard.schema import ATTRIBUTES, FIELDS
from meshshard_prep.datasets import ADAPTERS, read_dataset
from meshshard_prep.datasets.own.keys import KEYS
from meshshard_prep.fetch.sources import source_of
from meshshard_train.config import TrainConfig
from meshshard_train.recipes import RECIPES
from meshshard_train.settings import FIXED

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"


def table(text):
    """First cell -> other cells, of every row of the document's tables whose first cell is code."""
    rows = re.findall(r"^\| `([^`]+)` \|(.*)\|$", text, flags=re.M)
    return {name: [cell.strip() for cell in rest.split("|")] for name, rest in rows}


def blocks(path, language):
    return re.findall(rf"```{language}\n(.*?)```", path.read_text(), flags=re.S)


def test_format_document_is_the_schema():
    rows = table((DOCS / "format.md").read_text())
    for field in FIELDS:
        there = "MUST" if field.required else "MAY"
        axes = ", ".join(map(str, field.axes))
        assert rows.pop(field.name) == [axes, field.dtype, field.unit, there, field.meaning]
    for name, meaning in ATTRIBUTES.items():
        assert rows.pop(name) == [meaning]
    assert not [name for name in rows if "," not in name and len(rows[name]) > 1]


def test_format_document_names_every_key_of_the_index(tmp_path):
    text = (DOCS / "format.md").read_text().split("## index.json")[1]
    for key in json.loads((toy_dataset(tmp_path) / "index.json").read_text()):
        assert f"`{key}`" in text


def test_reading_block_of_the_format_document(tmp_path, monkeypatch, capsys):
    toy_dataset(tmp_path)
    (tmp_path / "shard-0.h5").rename(tmp_path / "shard.h5")
    monkeypatch.chdir(tmp_path)
    for block in blocks(DOCS / "format.md", "python"):
        exec(compile(block, "format.md", "exec"), {"h5py": h5py})
    assert capsys.readouterr().out == "14\nmesh000 (6, 3) (6, 16) (8, 3)\n"


def test_refusals_document_is_the_table_of_codes():
    rows = table((DOCS / "refusals.md").read_text())
    assert {code: meaning for code, (meaning, _) in rows.items()} == REFUSALS | FAILURES
    assert [code for code, (_, advice) in rows.items() if not advice.endswith(".")] == []


def test_every_refusal_code_is_raised_somewhere():
    sources = "".join(path.read_text() for path in (ROOT / "preprocess").rglob("*.py"))
    assert [code for code in (*REFUSALS, *FAILURES) if f'"{code}"' not in sources] == []


def commands():
    for entry in entry_points(group="meshshard.commands"):
        app = typer.Typer()
        app.command(entry.name)(entry.load())
        yield entry.name, typer.main.get_command(app)


def test_every_command_and_option_is_documented_and_nothing_else():
    sections = dict(
        re.findall(
            r"^## meshshard ([\w-]+)[^\n]*\n(.*?)(?=^## |\Z)", (DOCS / "cli.md").read_text(), flags=re.M | re.S
        )
    )
    found = dict(commands())
    assert set(sections) == set(found) == set(VERBS)
    for name, command in found.items():
        options = {o for p in command.params for o in (*p.opts, *p.secondary_opts) if o.startswith("--")} - {"--help"}
        options -= {"--install-completion", "--show-completion"}
        assert set(re.findall(r"--[a-z][a-z-]+", sections[name])) == options, name


def test_every_command_has_an_example_and_every_option_a_help():
    for name, command in commands():
        assert f"meshshard {name}" in command.help
        assert "Example" in command.help
        for parameter in command.params:
            assert parameter.help, (name, parameter.name)


@pytest.mark.parametrize("name", VERBS)
def test_every_help_is_shown_whole(name):
    # in square brackets it would be taken for a style, and be left out
    shown = CliRunner().invoke(app, [name, "--help"], env={"COLUMNS": "1000"}, color=False).output
    shown = " ".join(shown.split())
    for parameter in typer.main.get_command(app).get_command(None, name).params:
        assert " ".join(parameter.help.split()) in shown, parameter.name


def test_every_key_of_a_data_card_is_documented(tmp_path):
    section = (DOCS / "cli.md").read_text().split("## meshshard info")[1].split("## meshshard")[0]
    dataset = open_dataset(toy_dataset(tmp_path))
    card = data_card(dataset, survey(dataset))
    part = card["all"]
    for key in (*card, *part, *part["classes"][0], *part["faces"], *part["hks_error_bound"], *card["refused"]):
        assert f"`{key}`" in section, key


@pytest.mark.parametrize("name", ADAPTERS)
def test_every_data_set_has_a_page(name):
    adapter = ADAPTERS[name]
    page = DOCS / "datasets" / f"{adapter.page}.md"
    text = " ".join(page.read_text().split())
    rows = table(page.read_text())
    folder, expected = rows[f"meshshard features {name}"]
    assert folder.strip("`").removeprefix("made in `") == f"data/raw/{adapter.folder or name}"
    if adapter.expected:
        assert expected == ", ".join(f"{count} {what or 'meshes'}" for what, count in adapter.expected.items())
    assert f"Task: {adapter.task}" in text
    for part in (*adapter.licence.split("; "), *adapter.citation.split("; ")):
        assert part in text
    assert "**Get it:**" in text
    if source := source_of(adapter):
        shared = [other for other, found in ADAPTERS.items() if source_of(found) is source]
        assert any(f"`meshshard fetch {other}" in text for other in shared), shared
    assert "## Layout" in text
    assert "## Traps" in text
    assert "**Source:**" in text
    assert f"(datasets/{page.name})" in (DOCS / "datasets.md").read_text()


def test_toml_blocks_of_the_data_set_document(tmp_path):
    first, second = blocks(DOCS / "datasets.md", "toml")
    for patient in range(4):
        write_obj(tmp_path / "meshes" / "shapes" / f"patient{patient}_left.off", *box())
        write_labels(tmp_path / "meshes" / "gt" / f"patient{patient}_left.seg", [1, 2] * 6)
    for block in (first, second):
        (tmp_path / "bones.toml").write_text(block)
        dataset = read_dataset(str(tmp_path / "bones.toml"))
        assert (dataset.name, dataset.classes, len(dataset.entries)) == ("bones", ("femur", "tibia"), 4)
    assert dataset.entries[0].labels.classes == {0: -1, 1: 0, 2: 1, 3: 1}
    assert set(dataset.splits.values()) == {"train", "val", "test"}


def test_every_key_of_a_toml_file_is_documented_with_its_choices_and_nothing_else():
    section = (DOCS / "datasets.md").read_text().split("## Known by name")[0]
    rows = table(section)
    assert list(rows) == list(KEYS)
    for name, key in KEYS.items():
        assert [choice for choice in key.choices if f"`{choice}`" not in rows[name][0]] == []


def test_readme_python_block():
    (block,) = blocks(ROOT / "README.md", "python")
    done = subprocess.run([sys.executable, "-c", block], capture_output=True, text=True, check=True)
    assert done.stdout.startswith("(4, 16) [1.5707964 1.981")


def test_commands_in_all_documents_exist():
    known = {
        name: {option for parameter in command.params for option in parameter.opts} | {"--help"}
        for name, command in commands()
    }
    targets = set(re.findall(r"^([a-z]+):", (ROOT / "Makefile").read_text(), flags=re.M))
    for path in [ROOT / "README.md", *DOCS.rglob("*.md")]:
        lines = [
            line
            for block in re.findall(r"```(?:bash)?\n(.*?)```", path.read_text(), flags=re.S)
            for line in block.splitlines()
        ]
        for line in lines:
            words = re.split(r"[#|>;]", line)[0].split()
            if words and words[0].endswith("meshshard"):
                options = {word.split("=")[0] for word in words if word.startswith("--")}
                assert options <= known[words[1]], f"{path.name}: {line}"
            if words and words[0] == "make":
                assert words[1] in targets, f"{path.name}: {line}"


def test_recipes_of_features_are_those_of_the_document():
    rows = table((DOCS / "features.md").read_text())
    for field in fields(Recipe):
        if field.name != "name":
            values = [getattr(RECIPES_OF_FEATURES[name], field.name) for name in ("paper", "best", "official")]
            assert rows[field.name][:3] == [shown_value(value) for value in values], field.name


def shown_value(value):
    if isinstance(value, tuple):
        return f"{len(value)}, {value[0]:g} to {value[-1]:g}" if value else "none"
    return f"{value:g}" if isinstance(value, float) else str(value).lower()


def test_readme_begins_with_the_two_commands():
    (first, *_) = blocks(ROOT / "README.md", "")
    assert [line.split("  ")[0] for line in first.splitlines()] == ["make train", "make test"]


def dependencies():
    """Name of every package that pyproject.toml asks for -> what it comes with, as the document writes it."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    groups = {"always": project["project"]["dependencies"], "building": project["build-system"]["requires"]}
    groups |= {f"`{extra}`": names for extra, names in project["project"]["optional-dependencies"].items()}
    found = {}
    for group, requirements in groups.items():
        for requirement in requirements:
            name = re.match(r"[\w-]+", requirement)[0]
            if name != "meshshard":
                found.setdefault(name, []).append(group)
    return found


def test_every_dependency_has_its_licence_in_the_document():
    rows = table((DOCS / "licences.md").read_text())
    assert {name: set(cells[0].split(", ")) for name, cells in rows.items()} == {
        name: set(groups) for name, groups in dependencies().items()
    }
    for name, (_, licence) in rows.items():
        assert licence, name


WORDS = {
    "MIT": "MIT",
    "BSD": "BSD|Redistribution and use in source and binary",
    "Apache": "Apache",
    "MPL": "MPL|Mozilla",
    "GPL": "GPL|GNU",
    "PSF": "PSF|Python",
    "ISC": "ISC",
}
"""Family of licences -> what packages call it."""


@pytest.mark.parametrize("name", sorted(dependencies()))
def test_licences_are_those_that_packages_declare(name):
    try:
        declared = metadata(name)
    except PackageNotFoundError:
        pytest.skip(f"{name} is not installed")
    classifiers = [text for text in declared.get_all("Classifier") or [] if text.startswith("License ::")]
    said = " ".join(
        [declared.get("License-Expression") or " ".join(declared.get("License", "")[:200].split()), *classifiers]
    )
    if not said:
        said = " ".join(distribution(name).read_text(f"licenses/{file}") for file in declared.get_all("License-File"))
    _, licence = table((DOCS / "licences.md").read_text())[name]
    families = [words for family, words in WORDS.items() if licence.startswith(family)]
    assert len(families) == 1, licence
    assert re.search(families[0], said), said
    assert ("GPL" in licence) == bool(re.search(r"\bL?GPL|GNU", said)), said


def test_links_between_documents_lead_somewhere():
    for path in [ROOT / "README.md", *DOCS.rglob("*.md")]:
        for target in re.findall(r"\]\((?!https?://)([^)#]+)\)", path.read_text()):
            assert (path.parent / target).exists(), f"{path.name} -> {target}"


@pytest.mark.parametrize("target", ["features", "train", "test", "check"])
def test_make_alone_prints_its_targets(target):
    done = subprocess.run(["make"], cwd=ROOT, capture_output=True, text=True, check=True)
    assert f"  {target}" in done.stdout


def test_training_document_has_every_setting_with_its_defaults():
    rows = table((DOCS / "training.md").read_text())
    configs = [RECIPES[name]("segmentation") for name in RECIPES]
    for field in fields(TrainConfig):
        if field.name not in FIXED:
            values = [getattr(config, field.name) for config in configs]
            shown = [", ".join(v) if isinstance(v, tuple) else str(v).lower() for v in values]
            assert [cell.lower() for cell in rows[field.name][: len(configs)]] == shown, field.name
    assert set(RECIPES) <= set(rows)
