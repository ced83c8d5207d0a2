import json
import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from samples import PAPER as PAPER_RECIPE
from samples import sample, toy_dataset, write_dataset
from typer.testing import CliRunner

from meshshard import UsageError, open_dataset
from meshshard.cli import app
from meshshard.files import sha256_of_file
from meshshard_train import checkpoint, pictures
from meshshard_train.commands.progress import progress_bar
from meshshard_train.commands.shared import print_results
from meshshard_train.evaluate import VOTING_ROUNDS, Evaluation
from meshshard_train.loop import train
from meshshard_train.metrics import CLASS_FIGURES, FIGURES, Confusion
from meshshard_train.recipes import official, paper
from meshshard_train.results import rounds_of, write_results
from meshshard_train.tables import class_table, main_table

CPU = torch.device("cpu")
PAPER = paper("segmentation", width=16, epochs=2, batch_vertices=100, precision="fp32")
OFFICIAL = official("segmentation", width=16, epochs=1, features=("vertices", "hks"))
PUBLISHED = "published protocol: epoch chosen on TEST"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return toy_dataset(tmp_path_factory.mktemp("results") / "data")


@pytest.fixture(scope="module", params=[PAPER, OFFICIAL], ids=["paper", "official"])
def finished(request, folder, tmp_path_factory):
    """A run, its results, titles of its pictures, and what its progress says."""
    run, dataset, titles = tmp_path_factory.mktemp("run"), open_dataset(folder), {}
    with pytest.MonkeyPatch.context() as patch, progress_bar(2, 8) as tell:
        save = pictures.save_figure
        patch.setattr(
            pictures, "save_figure", lambda f, path: (titles.update({path.name: f.get_suptitle()}), save(f, path))
        )
        lines = []
        patch.setattr("typer.echo", lambda line, **_: lines.append(line))
        history = train(dataset, request.param, run, CPU, tell)
        results, paths = write_results(dataset, run, history, CPU)
    return {"run": run, "config": request.param, "results": results, "paths": paths, "titles": titles, "lines": lines}


def called(*words):
    """What a command prints on 80 columns, or the error that it ends with."""
    done = CliRunner().invoke(app, [str(word) for word in words], env={"COLUMNS": "80"})
    if done.exception and not isinstance(done.exception, SystemExit):
        raise done.exception
    return done.output


def test_every_figure_is_there_raw_and_voted_for_each_split(finished):
    results, official_run = finished["results"], finished["config"] is OFFICIAL
    assert json.loads((finished["run"] / "results.json").read_text()) == results
    names = FIGURES["segmentation"]
    assert list(results["rows"]) == (["test"] if official_run else ["val", "test"])
    for split, row in results["rows"].items():
        assert list(row) == [*names, *(f"voted_{name}" for name in names)]
        for kind, prefix in (("raw", ""), ("voted", "voted_")):
            matrix = np.array(results["confusion"][split][kind])
            assert np.trace(matrix) / matrix.sum() == pytest.approx(row[prefix + "accuracy"])
            per_class = results["per_class"][split][kind]
            assert list(per_class) == results["classes"] == ["low", "middle", "high"]
            assert np.mean([of["iou"] for of in per_class.values()]) == pytest.approx(row[prefix + "mean_iou"])
    assert results["config"] == json.loads(finished["config"].to_json())
    assert all(len(results[name]) == 64 for name in ("splits_sha256", "content_sha256", "checkpoint_sha256"))
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in finished["paths"])


def test_rounds_are_chosen_on_validation_or_fixed(finished):
    rounds = finished["results"]["voting_rounds"]
    assert rounds == 3 if finished["config"] is OFFICIAL else rounds in VOTING_ROUNDS
    assert rounds_of(finished["run"], finished["config"]) == rounds


@pytest.mark.parametrize(("right", "best"), [((5, 6, 7), 2), ((7, 7, 6), 0), ((5, 7, 7), 1)])
def test_the_fewest_rounds_of_the_best_are_chosen(right, best):
    voted = {rounds: Confusion(2) for rounds in range(3)}
    for rounds, confusion in voted.items():
        confusion.add(np.zeros(9, int), (np.arange(9) >= right[rounds]).astype(int))
    assert Evaluation(task="segmentation", raw=Confusion(2), voted=voted).best_rounds() == best


def test_the_protocol_stands_wherever_a_figure_is_shown(finished, capsys):
    """For recipe `official`: that the test split chose the epoch."""
    expected = PUBLISHED if finished["config"] is OFFICIAL else "epoch and rounds of voting chosen on validation"
    assert finished["results"]["protocol"] == expected
    assert json.loads((finished["run"] / "results.json").read_text())["protocol"] == expected
    sections = re.split(r"\n## ", (finished["run"] / "results.md").read_text())
    assert len(sections) == 1 + len(finished["results"]["rows"])
    assert all(expected in section for section in sections)
    assert len(finished["titles"]) == len(finished["paths"]) == 1 + 2 * len(finished["results"]["rows"])
    assert all(expected in title for title in finished["titles"].values())
    print_results(finished["results"])
    tables = [capsys.readouterr().out, called("evaluate", finished["run"])]
    tables.append(called("evaluate", finished["run"], "--split", "train"))
    for text in tables:
        assert " ".join(text.split()).count(expected) == 2
    assert json.loads(called("evaluate", finished["run"], "--json"))["protocol"] == expected
    assert len(finished["lines"]) == finished["config"].epochs
    for line in finished["lines"]:
        if expected == PUBLISHED:
            assert "test accuracy, voted " in line
            assert PUBLISHED in line
        else:
            assert "val accuracy, raw " in line


def test_tables_fit_into_80_columns(finished, capsys):
    print_results(finished["results"])
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= 80
    cells = [line.split() for line in lines]
    assert next(row for row in cells if row[:2] == ["mean", "IoU"])[2:] == main_table(finished["results"])[6][1:]
    wanted = class_table(finished["results"], "test", ("accuracy", "iou", "dice"))
    assert [row for row in cells if row[:1] in (["low"], ["middle"], ["high"])] == wanted[1:]


@pytest.mark.parametrize("task", ["segmentation", "classification"])
def test_forty_classes_with_long_names_fit_too(task, capsys, tmp_path):
    found, classes = Confusion(40), [f"class [{k}] of forty, with a long name" for k in range(40)]
    found.add(np.repeat(np.arange(38), 3), np.repeat(np.arange(38), 3))  # two are not there
    figures, row = found.of_classes(), found.summary()
    of = {name: {figure: values[k] for figure, values in figures.items()} for k, name in enumerate(classes)}
    kinds = ["raw", "voted"] if task == "segmentation" else ["raw"]
    results = {"dataset": "x", "recipe": "paper", "seed": 0, "epoch": 1, "voting_rounds": 1, "rounds_set": False}
    rows = {"test": row | {f"voted_{name}": value for name, value in row.items()}}
    results |= {"task": task, "protocol": "p", "classes": classes, "rows": rows}
    results |= {"config": {"votes_itself": True}, "meshes_trained": 1, "trained_on": {"test": 0}, "chosen_by": {}}
    print_results(results | {"per_class": {"test": dict.fromkeys(kinds, of)}})
    out = capsys.readouterr().out
    assert max(map(len, out.splitlines())) <= 80
    assert "class [39]" in out
    pictures.confusions(tmp_path / "a.png", dict.fromkeys(kinds, found.counts.astype(int)), classes, title="x")
    assert (tmp_path / "a.png").stat().st_size > 20_000


def test_evaluate_says_what_training_said_and_rounds_can_be_set(finished):
    run, results = finished["run"], finished["results"]
    told = json.loads(called("evaluate", run, "--json"))
    for name in ("rows", "per_class", "confusion"):
        assert told[name] == {"test": results[name]["test"]}
    assert told["rounds_set"] is False
    raw = json.loads(called("evaluate", run, "--rounds", 0, "--json"))
    assert (raw["voting_rounds"], raw["rounds_set"]) == (0, True)
    assert "chosen on validation" not in raw["protocol"] or raw["protocol"] == "epoch chosen on validation"
    assert all(raw["rows"]["test"][f"voted_{name}"] == raw["rows"]["test"][name] for name in FIGURES["segmentation"])
    assert "1 round of voting (set by --rounds)" in " ".join(called("evaluate", run, "--rounds", 1).split())


def test_evaluate_refuses_by_name(finished, tmp_path):
    run = finished["run"]
    others = "--split test, --split train, --split val"
    with pytest.raises(UsageError, match=f"no meshes in the split 'tset'; there are: {others}"):
        called("evaluate", run, "--split", "tset")
    with pytest.raises(UsageError, match=rf"is a file: name the folder of its run, as meshshard evaluate {run}"):
        called("evaluate", run / "best.safetensors")
    samples = [sample(n) for n in range(3)]
    other = write_dataset(tmp_path / "classes", samples, ["train", "val", "test"], classes=("a", "b", "c"))
    with pytest.raises(UsageError, match=r"classes: \('low', 'middle', 'high'\) against \('a', 'b', 'c'\)"):
        called("evaluate", run, "--data", other)
    recipe = replace(PAPER_RECIPE, components="bridged")
    other = write_dataset(tmp_path / "recipe", samples, ["train", "val", "test"], recipe=recipe)
    with pytest.raises(UsageError, match=r'feature recipe: .*"separate".* against .*"bridged"'):
        called("evaluate", run, "--data", other)
    samples = [sample(n, labels=None, mesh_label=0, label_domain="mesh") for n in range(3)]
    other = write_dataset(tmp_path / "task", samples, ["train", "val", "test"], task="classification")
    with pytest.raises(UsageError, match=r"is a data set for classification, the run is for segmentation"):
        called("evaluate", run, "--data", other)


def test_a_run_that_is_not_finished_has_no_rounds_but_those_that_are_set(finished, tmp_path):
    best = Path(shutil.copy(finished["run"] / "best.safetensors", tmp_path))
    if finished["config"] is PAPER:
        with pytest.raises(UsageError, match="is not finished"):
            called("evaluate", tmp_path)
        (tmp_path / "results.json").write_text("{}")
        with pytest.raises(UsageError, match="cannot be read"):
            called("evaluate", tmp_path)
        (tmp_path / "results.json").write_text(
            f'{{"checkpoint_sha256": "{sha256_of_file(best)}", "voting_rounds": -1}}'
        )
        with pytest.raises(UsageError, match="voting_rounds is 0 or more, not -1; go on with meshshard train"):
            called("evaluate", tmp_path)
        (tmp_path / "results.json").unlink()
    said = " ".join(called("evaluate", tmp_path, "--rounds", 2).split())
    assert "2 rounds of voting" in said
    assert "the run is not finished" in said


def test_classes_that_no_training_mesh_has_are_told(tmp_path, capsys):
    samples = [sample(n, labels=None, mesh_label=n % 2, label_domain="mesh") for n in range(6)]
    names, splits = ("even", "odd", "other"), ["train"] * 2 + ["val"] * 2 + ["test"] * 2
    dataset = open_dataset(write_dataset(tmp_path / "a", samples, splits, task="classification", classes=names))
    history = train(dataset, paper("classification", width=16, epochs=1, precision="fp32"), tmp_path / "run", CPU)
    results, paths = write_results(dataset, tmp_path / "run", history, CPU)
    assert [list(results["rows"][split]) for split in ("val", "test")] == [["accuracy", "class_accuracy"]] * 2
    assert [path.name for path in paths] == ["curves.png", "confusion-val.png", "confusion-test.png"]
    assert results["classes_not_trained"] == ["other"]
    assert json.loads((tmp_path / "run" / "results.json").read_text())["classes_not_trained"] == ["other"]
    print_results(results)
    for text in (capsys.readouterr().out, (tmp_path / "run" / "results.md").read_text()):
        assert "no training mesh has other: these classes cannot be learned" in text
        assert "voting" not in text
    assert results["voting_rounds"] == 0
    with pytest.raises(UsageError, match="--rounds is for segmentation and vertex_segmentation"):
        called("evaluate", tmp_path / "run", "--rounds", 1)


def test_figures_of_meshes_that_were_trained_on_say_so(finished):
    of_train, of_test = called("evaluate", finished["run"], "--split", "train"), called("evaluate", finished["run"])
    assert "8 of the meshes of train were trained on" in " ".join(of_train.split())
    assert "were trained on" not in of_test
    of_val = " ".join(called("evaluate", finished["run"], "--split", "val").split())
    assert ("of the meshes of val were trained on" in of_val) == (finished["config"] is OFFICIAL)


def test_a_split_that_chose_the_epoch_for_another_says_so(finished, folder, tmp_path):
    """The same meshes, whose splits for validation and test are exchanged."""
    samples = [open_dataset(folder)[number] for number in range(14)]
    other = write_dataset(tmp_path / "b", samples, ["train"] * 8 + ["test"] * 3 + ["val"] * 3)
    found = json.loads(called("evaluate", finished["run"], "--data", other, "--json"))
    said = " ".join(called("evaluate", finished["run"], "--data", other).split())
    if finished["config"] is OFFICIAL:  # it trains on validation too, and test chooses
        assert (found["trained_on"], found["chosen_by"]) == ({"test": 3}, {})
    else:
        assert (found["trained_on"], found["chosen_by"]) == ({"test": 0}, {"test": 3})
        assert "3 of the meshes of test chose the epoch" in said


def test_data_that_was_moved_away_is_asked_for(tmp_path):
    dataset = open_dataset(toy_dataset(tmp_path / "data"))
    train(dataset, replace(PAPER, epochs=1), tmp_path / "run", CPU)
    (tmp_path / "data").rename(tmp_path / "moved")
    with pytest.raises(UsageError, match="data, which is not there: name its shards with --data FOLDER"):
        called("evaluate", tmp_path / "run", "--rounds", 0)
    assert "1 round of voting" in called("evaluate", tmp_path / "run", "--rounds", 1, "--data", tmp_path / "moved")


def test_data_behind_a_url_is_looked_for_there(finished, tmp_path):
    best = checkpoint.load(finished["run"] / "best.safetensors")
    state = best.state | {"folder": "memory://nowhere/data"}
    checkpoint.save(tmp_path / "best.safetensors", replace(best, state=state))
    with pytest.raises(UsageError, match="was trained on memory://nowhere/data, which is not there"):
        called("evaluate", tmp_path, "--rounds", 0)


def test_every_key_and_figure_is_documented(finished):
    docs = Path(__file__).parents[2] / "docs"
    section = (docs / "cli.md").read_text().split("## meshshard evaluate")[1].split("## meshshard")[0]
    assert [key for key in finished["results"] if f"`{key}`" not in section] == []
    text = (docs / "metrics.md").read_text()
    assert [name for name in (*FIGURES["segmentation"], *CLASS_FIGURES) if f"`{name}`" not in text] == []
    assert f"among {', '.join(map(str, VOTING_ROUNDS[:-1]))} and {VOTING_ROUNDS[-1]}" in " ".join(text.split())
