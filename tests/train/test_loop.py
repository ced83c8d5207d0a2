import json
from dataclasses import replace

import numpy as np
import pytest
import torch
from samples import PAPER, sample, toy_dataset, write_dataset

from meshshard import UsageError, open_dataset
from meshshard_train import checkpoint, loop
from meshshard_train.loop import learning_rate, train
from meshshard_train.recipes import official, paper

CPU = torch.device("cpu")
CONFIG = paper("segmentation", width=16, epochs=4, warmup_epochs=1.0, batch_vertices=100, precision="fp32")


@pytest.fixture
def dataset(tmp_path):
    return open_dataset(toy_dataset(tmp_path / "data"))


def numbers_of(history):
    return [{k: v for k, v in row.items() if k not in ("seconds", "waited")} for row in history]


def test_it_learns(dataset, tmp_path):
    # labels are bands of height: turns about another axis than y would take them away
    config = replace(CONFIG, width=64, epochs=16, learning_rate=3e-3, rotation_axes="y")
    history = train(dataset, config, tmp_path / "run", CPU)
    assert history[-1]["loss"] < 0.8 * history[0]["loss"]
    assert history[-1]["val_accuracy"] > 0.8
    lines = (tmp_path / "run" / "metrics.jsonl").read_text().splitlines()
    assert [json.loads(line) for line in lines] == history


def test_a_finished_run_is_left_alone(dataset, tmp_path):
    first = train(dataset, CONFIG, tmp_path / "run", CPU)
    before = (tmp_path / "run" / "last.safetensors").read_bytes()
    assert train(dataset, CONFIG, tmp_path / "run", CPU) == first
    assert (tmp_path / "run" / "last.safetensors").read_bytes() == before


def test_the_seed_decides(dataset, tmp_path):
    histories = [
        train(dataset, replace(CONFIG, seed=s, epochs=1), tmp_path / f"{i}", CPU) for i, s in enumerate((0, 0, 1))
    ]
    assert numbers_of(histories[0]) == numbers_of(histories[1]) != numbers_of(histories[2])


def test_best_is_the_last_of_the_highest_validation_accuracy(dataset, tmp_path):
    history = train(dataset, CONFIG, tmp_path / "run", CPU)
    accuracies = [row["val_accuracy"] for row in history]
    best = checkpoint.load(tmp_path / "run" / "best.safetensors")
    assert best.state["epoch"] == max(np.flatnonzero(np.equal(accuracies, max(accuracies))))


def test_another_configuration_or_data_set_is_refused_with_both_values(dataset, tmp_path):
    train(dataset, replace(CONFIG, epochs=1), tmp_path / "run", CPU)
    with pytest.raises(UsageError, match=r"learning_rate: 0.002 against 0.003"):
        train(dataset, replace(CONFIG, epochs=1, learning_rate=0.003), tmp_path / "run", CPU)
    with pytest.raises(UsageError, match=r"features: \('vertices', .*, 'hks'\) against \('hks',\)"):
        train(dataset, replace(CONFIG, epochs=1, features=("hks",)), tmp_path / "run", CPU)
    samples = [sample(n) for n in range(4)]
    for changes, message in (
        ({"recipe": replace(PAPER, name="mine")}, r'feature recipe: .*"name":"paper".* against .*"name":"mine"'),
        ({"classes": ("a", "b", "c")}, r"classes: \('low', 'middle', 'high'\) against \('a', 'b', 'c'\)"),
        ({}, "splits_sha256: "),
        ({}, "content_sha256: "),
    ):
        other = write_dataset(tmp_path / message[:4], samples, ["train", "train", "val", "test"], **changes)
        with pytest.raises(UsageError, match=message):
            train(open_dataset(other), replace(CONFIG, epochs=1), tmp_path / "run", CPU)


def test_empty_splits_are_named(tmp_path):
    folder = write_dataset(tmp_path / "a", [sample(0), sample(1)], ["train", "test"])
    with pytest.raises(UsageError, match=r"no meshes in the split 'val' \(test: 1, train: 1\)"):
        train(open_dataset(folder), CONFIG, tmp_path / "run", CPU)


def test_a_split_that_chooses_has_labels(tmp_path):
    samples = [sample(n, **({"face_labels": np.full(32, -1, dtype="i2")} if n == 2 else {})) for n in range(4)]
    folder = write_dataset(tmp_path / "a", samples, ["train", "train", "val", "test"])
    with pytest.raises(UsageError, match="nothing in the split 'val' has a label, and it chooses the epoch"):
        train(open_dataset(folder), CONFIG, tmp_path / "run", CPU)


def test_a_loss_that_is_not_finite_names_its_meshes(dataset, tmp_path, monkeypatch):
    original = loop.mesh_losses
    monkeypatch.setattr(loop, "mesh_losses", lambda *a: original(*a) * float("nan"))
    with pytest.raises(UsageError, match=r"epoch 0: the loss is not finite on \['mesh00"):
        train(dataset, CONFIG, tmp_path / "run", CPU)


def test_schedule():
    config = paper("segmentation", width=16, epochs=20, warmup_epochs=4.0, learning_rate=0.1)
    rates = [learning_rate(config, epoch) for epoch in (0.0, 2.0, 4.0, 12.0, 20.0)]
    assert rates == pytest.approx([1e-4, 0.05005, 0.1, 0.05, 0], abs=1e-12)
    published = official("segmentation")
    assert [learning_rate(published, epoch) for epoch in (0.0, 20.0, 1000.0)] == pytest.approx(
        [3e-7, 3e-4, 0], abs=1e-12
    )
    assert {learning_rate(official("classification"), epoch) for epoch in (0.0, 0.5, 999.0)} == {3e-4}
    assert learning_rate(replace(config, epochs=6), 2.0) == pytest.approx(0.1)  # a short run leaves warm-up too
