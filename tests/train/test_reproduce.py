"""The paper's tables: each training is done once, recorded, and every figure on a page is one of a record."""

import json
import re
import shutil
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from samples import toy_dataset
from typer.testing import CliRunner

from meshshard import UsageError, open_dataset
from meshshard.cli import app
from meshshard_train.config import PUBLISHED_PROTOCOL
from meshshard_train.reproduce import experiments, trials
from meshshard_train.reproduce.experiments import TABLES, Data, Line, Table
from meshshard_train.reproduce.figures import mean_and_deviation
from meshshard_train.reproduce.pages import END, START, write_pages
from meshshard_train.reproduce.trials import PROTOCOLS, RUNS, Trial, all_trials, record_of, shards_of
from meshshard_train.settings import resolved

RESULTS = Path(__file__).parents[2] / "docs/results"
TASKS = {"shrec_16": "classification", "shrec11_split10": "classification"}
TOY = Table(
    title="Toys",
    about="Two lines.",
    lines=(
        Line(name="one", data=Data(name="toy"), settings={"epochs": 1, "width": 16}, paper=50.0, honest_goal=0.0),
        Line(
            name="two",
            data=Data(name="toy"),
            settings={"epochs": 1, "width": 16, "features": ("hks",)},
            published_goal=101.0,
        ),
    ),
)


def every_trial():
    seeds = dict.fromkeys(PROTOCOLS, 2)
    return [trial for table in TABLES.values() for trial in all_trials(table.lines, PROTOCOLS, seeds)]


def config_of(trial):
    return trial.config(TASKS.get(trial.data.name, "segmentation"))


def test_different_trainings_have_different_names_and_lines_that_are_alike_share_one():
    named = {trial.name: trial for trial in every_trial()}
    assert all(named[trial.name] == trial for trial in every_trial())
    assert len({config_of(trial).to_json() + trial.data.label for trial in named.values()}) == len(named)
    shared = [table for table in TABLES.values() if experiments.NETWORK in table.lines]
    assert len(shared) == 2


@pytest.mark.parametrize("trial", {trial.name: trial for trial in every_trial() if trial.seed == 0}.values())
def test_a_protocol_says_what_chose_and_the_command_trains_alike(trial):
    config = config_of(trial)
    assert (config.protocol == PUBLISHED_PROTOCOL) == (trial.protocol == "published")
    command = trial.train_command(config.task, Path("SHARDS"))
    assert command[:4] == ["train", "SHARDS", "--recipe", trial.recipe]
    assert resolved(trial.recipe, config.task, None, command[5::2], {}) == config


def test_only_drawn_splits_are_those_of_the_seed():
    fixed = Trial(data=Data(name="a"), recipe="paper", settings=(), protocol="honest", seed=3)
    drawn = replace(fixed, data=Data(name="a", raw="b", drawn=True))
    assert (fixed.split_seed, drawn.split_seed) == (0, 3)
    assert "--raw" not in fixed.prepare_command(Path("r"), Path("o"))
    words = drawn.prepare_command(Path("r"), Path("o"))
    assert words == ["features", "a", "--raw", "r/b", "--recipe", "paper", "--split-seed", "3", "--out", "o"]
    assert replace(fixed, data=Data(name="a", features="best")).name != fixed.name
    copies = replace(fixed, data=Data(name="a", deformed=2))
    assert copies.name != fixed.name
    assert copies.prepare_command(Path("r"), Path("o"))[4:6] == ["--deformed", "2"]


def test_the_first_seed_of_all_lines_comes_first():
    found = all_trials(TABLES["features"].lines, ("honest",), {"honest": 3})
    assert [trial.seed for trial in found] == [0] * 4 + [1] * 4 + [2] * 4


@pytest.mark.parametrize("count", [2, 3, 7])
def test_mean_and_deviation_are_those_of_a_sample(count):
    values = np.random.default_rng(count).uniform(80, 100, count)
    assert mean_and_deviation(values.tolist()) == f"{values.mean():.2f} ± {values.std(ddof=1):.2f} ({count})"
    assert (mean_and_deviation([]), mean_and_deviation([90.125])) == ("-", "90.12 (1)")


@pytest.fixture
def toy(tmp_path, monkeypatch):
    """The command, with a table of two lines over generated shapes in place of minicoseg's."""
    data = toy_dataset(tmp_path / "data")
    monkeypatch.setitem(TABLES, "minicoseg", TOY)
    monkeypatch.setattr(trials, "shards_of", lambda *_: data)

    def call(*words):
        where = ["--work", str(tmp_path / "work"), "--out", str(tmp_path / "results")]
        done = CliRunner().invoke(app, ["reproduce", "minicoseg", *where, *words])
        if done.exception and not isinstance(done.exception, SystemExit):
            raise done.exception
        assert done.exit_code == 0, done.output
        return done.output

    return call


@pytest.mark.usefixtures("fine_pictures")
def test_what_is_recorded_is_not_done_again_and_pages_show_the_records(toy, tmp_path):
    out = tmp_path / "results"
    out.mkdir()
    (out / "README.md").write_text(f"# Ours\n\n{START}{END}why\n")
    toy("--protocol", "honest", "--seeds", "1")
    first = {path: path.read_bytes() for path in (out / RUNS).iterdir()}
    assert len(first) == 2
    toy("--seeds", "2")
    assert all(path.read_bytes() == content for path, content in first.items())
    records = {path.stem: json.loads(path.read_bytes()) for path in (out / RUNS).iterdir()}
    assert len(records) == 6
    page = (out / "minicoseg.md").read_text()
    for name, record in records.items():
        rows = record["results"]["rows"]
        line = next(line for line in page.splitlines() if f"{RUNS}/{name}.json" in line)
        assert f"| {100 * rows['test']['accuracy']:.2f} | {100 * rows['test']['voted_accuracy']:.2f} |" in line
        assert ("val" in rows) == (record["protocol"] == "honest")
        assert record["shards_sha256"] == [shard.sha256 for shard in open_dataset(tmp_path / "data").index.shards]
        assert len(record["commands"]) == 2
    honest = [
        100 * records[f"toy-paper-epochs=1-width=16-honest-seed={n}"]["results"]["rows"]["test"]["accuracy"]
        for n in (0, 1)
    ]
    table = re.search(r"\| one \| 50.0 \|.*", page).group()
    assert f"| {mean_and_deviation(honest)} |" in table
    assert table.endswith("| 0.0 reached |")
    assert "| 101.0 missed |" in re.search(r"\| two \| - \|.*", page).group()
    readme = (out / "README.md").read_text()
    assert readme.startswith("# Ours\n")
    assert readme.endswith("\nwhy\n")
    assert table in readme
    assert (out / "minicoseg.png").stat().st_size > 5000


def test_one_line_of_a_table(toy, tmp_path):
    toy("--protocol", "honest", "--seeds", "1", "--line", "two")
    assert [path.name for path in (tmp_path / "results" / RUNS).iterdir()] == [
        "toy-paper-epochs=1-features=hks-width=16-honest-seed=0.json"
    ]
    assert "| one | 50.0 | - |" in (tmp_path / "results/minicoseg.md").read_text()


def test_what_cannot_be_compiled_is_trained_as_it_is_and_said(toy, tmp_path, monkeypatch):
    settings = {"epochs": 1, "width": 16, "normalisation": "instance"}
    whole = Line(name="whole", data=Data(name="toy"), settings=settings)
    monkeypatch.setitem(TABLES, "minicoseg", replace(TOY, lines=(whole,)))
    assert "not compiled: its layers look at more than one vertex" in toy(
        "--protocol", "honest", "--seeds", "1", "--compile"
    )
    (path,) = (tmp_path / "results" / RUNS).iterdir()
    assert json.loads(path.read_bytes())["results"]["compiled"] is False


def test_pages_are_written_without_training(toy, tmp_path):
    toy("--protocol", "honest", "--seeds", "1")
    page = tmp_path / "results/minicoseg.md"
    before = page.read_text()
    assert "| one | 50.0 | - | stated |" in before
    page.unlink()
    shutil.rmtree(tmp_path / "work")
    toy("--pages")
    assert page.read_text() == before
    assert not (tmp_path / "work").exists()


@pytest.mark.parametrize(
    ("content", "why"),
    [
        ("{", "JSONDecodeError"),
        ("{}", "KeyError"),
        ("[]", "TypeError"),
        ('{"name": "another"}', "it is that of another"),
        ({}, None),
        ({"width": 32, "epochs": 7}, "settings have changed since, width: 32 against .*; epochs: 7 against "),
        ({"colour": 1}, r"unknown training settings \['colour'\]"),
    ],
)
def test_a_file_that_is_no_record_of_the_training_is_refused_by_name(tmp_path, content, why):
    """A recipe that changed would leave figures under its name that it does not give."""
    trial = Trial(data=Data(name="a"), recipe="paper", settings=(), protocol="honest", seed=0)
    if isinstance(content, dict):
        config = json.loads(trial.config("segmentation").to_json()) | content
        content = json.dumps({"name": trial.name, "results": {"config": config}})
    (tmp_path / RUNS).mkdir()
    (tmp_path / RUNS / f"{trial.name}.json").write_text(content)
    if why is None:
        assert record_of(tmp_path, trial)["name"] == trial.name
        return
    with pytest.raises(UsageError, match=rf"{trial.name}\.json is no record of this training \(.*{why}.*delete it"):
        record_of(tmp_path, trial)


def test_a_page_whose_tables_have_no_end_is_left_alone(tmp_path):
    (tmp_path / "README.md").write_text(f"# Ours\n{START}my notes\n")
    with pytest.raises(UsageError, match="without <!-- end of what it made -->"):
        write_pages(tmp_path)
    assert (tmp_path / "README.md").read_text().endswith("my notes\n")


def test_data_that_is_not_what_was_published_has_no_figures(tmp_path, monkeypatch):
    folder = tmp_path / "a-split-0"
    folder.mkdir()
    toy_dataset(folder, notes=("7 of 381 training meshes",))
    monkeypatch.setattr(trials.subprocess, "run", lambda *_, **__: SimpleNamespace(returncode=0, stderr=""))
    trial = Trial(data=Data(name="a", raw="b"), recipe="paper", settings=(), protocol="honest", seed=0)
    with pytest.raises(UsageError, match="not the data that was published: 7 of 381 training meshes"):
        shards_of(trial, tmp_path, tmp_path)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["cheese"], "no table 'cheese'"),
        (["human", "--protocol", "x"], "'x'"),
        (["human", "--line", "x"], "--line 'x': the lines of human are recipe paper, "),
    ],
)
def test_unknown_names_are_refused_with_those_there_are(words, said):
    done = CliRunner().invoke(app, ["reproduce", *words])
    assert isinstance(done.exception, UsageError)
    assert said in str(done.exception)


def test_shards_are_made_by_the_program_and_its_refusal_is_told(tmp_path):
    trial = Trial(data=Data(name="nothing_so_called"), recipe="paper", settings=(), protocol="honest", seed=0)
    with pytest.raises(UsageError, match=r"meshshard features nothing_so_called .*nothing_so_called"):
        shards_of(trial, tmp_path, tmp_path)


def test_committed_pages_are_those_of_the_committed_records(tmp_path):
    (tmp_path / RUNS).mkdir()
    for path in (RESULTS / RUNS).glob("*.json"):
        (tmp_path / RUNS / path.name).write_bytes(path.read_bytes())
    (tmp_path / "README.md").write_bytes((RESULTS / "README.md").read_bytes())
    write_pages(tmp_path)
    written = {path.name: path.read_text() for path in tmp_path.glob("*.md")}
    assert written == {path.name: path.read_text() for path in RESULTS.glob("*.md")}


def test_every_committed_record_is_of_a_training_of_some_table():
    names = {replace(trial, seed=seed).name for trial in every_trial() for seed in range(10)}
    committed = {path.stem for path in (RESULTS / RUNS).glob("*.json")}
    assert committed - names == set()
    assert len(committed) > 40
