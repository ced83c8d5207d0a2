from dataclasses import replace

import numpy as np
import pytest
import safetensors.torch
import torch
from samples import PAPER

from meshshard.errors import UsageError
from meshshard_train import checkpoint
from meshshard_train.checkpoint import Checkpoint
from meshshard_train.config import TrainConfig, paper
from meshshard_train.model import TaskDrivenNet


@pytest.fixture
def made():
    network = TaskDrivenNet(23, 3)
    return Checkpoint(
        tensors={f"net.{k}": v for k, v in network.state_dict().items()} | {"opt.0.step": torch.tensor(3.0)},
        config=paper("segmentation"),
        classes=("a", "b", "ç"),
        recipe=PAPER,
        splits_sha256="0" * 64,
        content_sha256="1" * 64,
        state={"epoch": 4},
    )


def test_round_trip(made, tmp_path):
    checkpoint.save(tmp_path / "a", made)
    found = checkpoint.load(tmp_path / "a")
    assert replace(found, tensors={}) == replace(made, tensors={})
    assert all(torch.equal(found.tensors[name], tensor) for name, tensor in made.tensors.items())
    features = torch.randn(4, 23)
    network = TaskDrivenNet(23, 3).eval()
    network.load_state_dict({k[4:]: v for k, v in made.tensors.items() if k.startswith("net.")})
    torch.testing.assert_close(found.network()(features), network(features))


def test_every_damage_is_noticed(made, tmp_path):
    """Flipped bits anywhere, and cuts. A change that leaves names, numbers and text as they were is none."""
    path = tmp_path / "a"
    checkpoint.save(path, made)
    whole = path.read_bytes()
    rng = np.random.default_rng(0)
    for place in [*rng.integers(0, 6000, 60), *rng.integers(0, len(whole), 40)]:
        damaged = bytearray(whole)
        damaged[place] ^= 1 << int(rng.integers(8))
        path.write_bytes(damaged)
        with pytest.raises(UsageError, match=r"is damaged|not a readable checkpoint|not a meshshard checkpoint"):
            checkpoint.load(path)
    for length in (0, 7, 100, len(whole) - 1):
        path.write_bytes(whole[:length])
        with pytest.raises(UsageError, match="not a readable checkpoint"):
            checkpoint.load(path)


def test_other_files_are_refused_by_name(tmp_path):
    with pytest.raises(UsageError, match="is not there; train first"):
        checkpoint.load(tmp_path / "none")
    (tmp_path / "a.png").write_bytes(b"\x89PNG\r\n\x1a\n" + b"\0" * 99)
    with pytest.raises(UsageError, match="not a readable checkpoint"):
        checkpoint.load(tmp_path / "a.png")
    safetensors.torch.save_file({"x": torch.ones(2)}, tmp_path / "other")
    with pytest.raises(UsageError, match="not a meshshard checkpoint"):
        checkpoint.load(tmp_path / "other")


@pytest.mark.parametrize(
    "change",
    [
        {"task": "x"},
        {"features": ()},
        {"features": ("colour",)},
        {"scaling": "x"},
        {"epochs": 0},
        {"learning_rate": 0.0},
        {"drop_path": 1.0},
        {"rotation_axes": "w"},
        {"precision": "fp8"},
        {"batch_vertices": 0},
        {"label_smoothing": 1.0},
    ],
)
def test_nonsense_is_no_configuration(change):
    with pytest.raises(UsageError, match=f"training setting {next(iter(change))} is "):
        replace(paper("segmentation"), **change)


def test_configuration_round_trip():
    config = paper("classification", seed=5, features=("vertices",))
    assert TrainConfig.from_json(config.to_json()) == config
    with pytest.raises(UsageError, match=r"unknown training settings \['lr'\]"):
        TrainConfig.from_json('{"lr": 1}')
    assert config.differences(replace(config, seed=6)) == ["seed: 5 against 6"]
