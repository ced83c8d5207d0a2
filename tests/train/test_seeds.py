"""The same training from several seeds."""

import json

import numpy as np
import pytest
import typer
from samples import toy_dataset
from typer.testing import CliRunner

from meshshard import UsageError
from meshshard_train.commands import runs
from meshshard_train.commands.train import train
from meshshard_train.seeds import table_rows, write_seeds

NAMES = {
    "dataset": "toy",
    "task": "segmentation",
    "recipe": "paper",
    "feature_recipe": "paper",
    "protocol": "honest",
    "epoch": 4,
    "voting_rounds": 2,
}


def result(seed, accuracy):
    return NAMES | {"seed": seed, "rows": {"test": {"accuracy": accuracy, "class_iou": [0.5, accuracy]}}}


@pytest.mark.parametrize("count", [2, 3, 5])
def test_mean_and_deviation_are_those_of_a_sample(tmp_path, count):
    values = np.random.default_rng(count).random(count)
    results = [result(7 + number, float(value)) for number, value in enumerate(values)]
    summary = write_seeds(tmp_path, results)
    assert list(summary["figures"]["test"]) == ["accuracy"]  # lists have no mean
    found = summary["figures"]["test"]["accuracy"]
    assert found["values"] == values.tolist()
    assert (found["mean"], found["deviation"]) == pytest.approx((values.mean(), values.std(ddof=1)))
    assert summary["runs"] == results
    assert json.loads((tmp_path / "seeds.json").read_text()) == summary
    head, epochs, rounds, line = table_rows(summary)
    assert (epochs[1:], rounds[1:]) == (
        ["epoch", "", "", *["4"] * count],
        ["rounds of voting", "", "", *["2"] * count],
    )
    assert head == ["split", "figure", "mean", "deviation", *(f"seed {7 + number}" for number in range(count))]
    assert line[:3] == ["test", "accuracy", f"{100 * values.mean():.2f}"]
    assert "| test | accuracy |" in (tmp_path / "seeds.md").read_text()


def test_one_run_has_no_deviation(tmp_path):
    write_seeds(tmp_path, [result(0, 0.5)])
    assert json.loads((tmp_path / "seeds.json").read_text())["figures"]["test"]["accuracy"]["deviation"] is None


def test_stopped_between_seeds_it_goes_on(tmp_path, monkeypatch):
    """The second seed is interrupted; called again, the first is left alone. Progress is not on standard output."""
    toy_dataset(tmp_path / "data")
    program = typer.Typer()
    program.command()(train)
    words = [
        str(tmp_path / "data"),
        "--run",
        str(tmp_path / "run"),
        "--epochs",
        "1",
        "--precision",
        "fp32",
        "--set",
        "width=16",
    ]
    words += ["--seed", "4", "--seeds", "2", "--json", "--tensorboard", "--device", "cpu"]
    original = runs.train

    def interrupted(dataset, config, *arguments):
        if config.seed == 5:
            raise KeyboardInterrupt
        return original(dataset, config, *arguments)

    monkeypatch.setattr(runs, "train", interrupted)
    stopped = CliRunner().invoke(program, words)
    assert isinstance(stopped.exception, UsageError)
    text = "stopped; the same command goes on where it was saved last, at most 5 minutes of training before"
    assert str(stopped.exception) == text
    before = (tmp_path / "run" / "seed-4" / "last.safetensors").read_bytes()
    monkeypatch.setattr(runs, "train", original)
    done = CliRunner().invoke(program, words)
    assert (tmp_path / "run" / "seed-4" / "last.safetensors").read_bytes() == before
    summary = json.loads(done.stdout)
    assert summary["seeds"] == [4, 5]
    single = [json.loads((tmp_path / "run" / f"seed-{seed}" / "results.json").read_text()) for seed in (4, 5)]
    assert summary["runs"] == single
    assert summary["figures"]["test"]["accuracy"]["values"] == [one["rows"]["test"]["accuracy"] for one in single]
    assert list((tmp_path / "run" / "seed-5" / "tensorboard").glob("events.out.tfevents.*"))
    assert "epoch 0  loss" in done.stderr
