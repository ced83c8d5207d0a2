"""Killed at any moment, a run goes on to what it would have been: losses, weights and files, to the bit."""

import json
import shutil
from dataclasses import replace

import pytest
from effort import SOAKING
from samples import toy_dataset
from training import CONFIG, died, outcome, rows, train_here

from meshshard import UsageError, open_dataset
from meshshard_train import checkpoint, loop
from meshshard_train.schedule import best_epoch


@pytest.fixture(scope="module")
def world(tmp_path_factory):
    """A data set, `unbroken`: its run that nothing stopped, and `begun`: the same, killed after its first epoch."""
    root = tmp_path_factory.mktemp("resume")
    toy_dataset(root / "data")
    assert not died(root / "data", root / "unbroken", 0)
    assert died(root / "data", root / "begun", 1 + steps(root / "data", 0) + 5 + 1)  # start, steps, renames, epoch
    return root


def steps(data, epoch):
    """How many an epoch has."""
    dataset = open_dataset(data)
    passes = (epoch * CONFIG.passes + number for number in range(CONFIG.passes))
    return sum(len(loop.steps_of(dataset.splits["train"], dataset.vertex_counts, CONFIG, drawn)) for drawn in passes)


def ends_alike(world, run):
    found = outcome(run)
    assert found == outcome(world / "unbroken")
    texts = [(folder / "metrics.jsonl").read_text() for folder in (run, world / "unbroken")]
    lines, whole = ([json.loads(line) for line in text.splitlines()] for text in texts)
    assert rows(lines) == found[0]
    assert [list(line) for line in lines] == [list(line) for line in whole]


def test_killed_within_epochs_again_and_again(world, tmp_path):
    """Each process gets a little further: one is killed at its second moment, the next at its seventh, and so on; a
    checkpoint precedes every step."""
    moment = 2
    while died(world / "data", tmp_path / "run", moment, 0.0):
        moment += 5
    assert moment > 15
    ends_alike(world, tmp_path / "run")


def test_killed_at_the_worst_moments_one_after_the_other(world, tmp_path):
    """While last is the previous already and there is none; while there is no best; and before metrics.jsonl."""
    run = tmp_path / "run"
    shutil.copytree(world / "begun", run)
    before = 1 + 1 + 1 + steps(world / "data", 1)  # config and metrics again, start, steps
    assert died(world / "data", run, before + 3)
    assert not (run / "last.safetensors").exists()
    assert died(world / "data", run, before + 2 + 3)  # there is no last to move aside
    assert not (run / "best.safetensors").exists()
    assert died(world / "data", run, 3)
    assert len((run / "metrics.jsonl").read_text().splitlines()) == 1
    assert not died(world / "data", run, 0)
    ends_alike(world, run)


@pytest.mark.parametrize("rename", range(1, 8) if SOAKING else (4,))
def test_killed_between_the_files_of_an_epoch(world, tmp_path, rename):
    """Before each of the renames by which last, best and metrics.jsonl get their names; the fourth is the first of
    best."""
    assert best_epoch(outcome(world / "unbroken")[0]) == 1  # so the second epoch writes all three
    shutil.copytree(world / "begun", tmp_path / "run")
    moment = 1 + 1 + steps(world / "data", 1) + rename  # metrics again, start, steps
    assert died(world / "data", tmp_path / "run", moment)
    assert not died(world / "data", tmp_path / "run", 0)
    ends_alike(world, tmp_path / "run")
    before = checkpoint.load(tmp_path / "run" / "previous-best.safetensors")
    assert before.state["epoch"] == 0


def test_a_run_that_stopped_early_stays_stopped(world, tmp_path, monkeypatch):
    config = replace(CONFIG, epochs=9, patience=2)
    scores = iter((0.5, 0.6, 0.6, 0.1))
    monkeypatch.setattr(loop, "_judge", lambda *_: {"score": next(scores)})
    history = train_here(world / "data", tmp_path / "run", config)
    assert [row["score"] for row in history] == [0.5, 0.6, 0.6, 0.1]  # 2 and 3 are no better than 1
    assert train_here(world / "data", tmp_path / "run", config) == history
    best = checkpoint.load(tmp_path / "run" / "best.safetensors")
    assert best.state["epoch"] == best_epoch(history) == 2  # the last of equals


def test_best_that_does_not_belong_to_last_is_told_with_both_epochs(world, tmp_path):
    """As after going back to an older last by hand."""
    run = tmp_path / "run"
    shutil.copytree(world / "unbroken", run)
    shutil.copy(run / "previous-best.safetensors", run / "best.safetensors")
    longer = replace(CONFIG, epochs=3)
    last = checkpoint.load(run / "last.safetensors")
    state = last.state | {"step": 1}
    checkpoint.save(run / "last.safetensors", replace(last, config=longer, state=state))
    with pytest.raises(
        UsageError, match=r"best.safetensors is of epoch 0, and the best .* is 1; take the one before: mv "
    ):
        train_here(world / "data", run, longer)


@pytest.mark.parametrize("name", ["last.safetensors", "best.safetensors"])
def test_a_file_that_is_no_checkpoint_is_refused_with_the_way_back(world, tmp_path, name):
    run = tmp_path / "run"
    shutil.copytree(world / "begun", run)
    whole = (run / name).read_bytes()
    for content in (whole[:-1], whole[: len(whole) // 2], b"\x89PNG\r\n\x1a\n" + bytes(99), b""):
        (run / name).write_bytes(content)
        if name == "last.safetensors":
            with pytest.raises(UsageError, match=rf"{name} is no checkpoint that can be used: .*; delete .* anew"):
                train_here(world / "data", run)
    if name == "last.safetensors":
        shutil.copy(world / "begun" / name, run / f"previous-{name}")
        with pytest.raises(UsageError, match=rf"mv {run}/previous-{name} {run}/{name}"):
            train_here(world / "data", run)
    else:  # it follows from last, and is written anew
        train_here(world / "data", run)
        ends_alike(world, run)
