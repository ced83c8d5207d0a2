from dataclasses import replace

import pytest
import safetensors.torch
import torch
from damage import damaged
from effort import times
from samples import PAPER, toy_dataset

from meshshard import open_dataset
from meshshard.errors import UsageError
from meshshard_train import checkpoint
from meshshard_train.checkpoint import Checkpoint
from meshshard_train.config import TrainConfig
from meshshard_train.model import TaskDrivenNet
from meshshard_train.recipes import paper


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


@pytest.mark.soak
def test_every_damage_is_noticed(made, tmp_path, measured):
    """Flipped bits, cuts, zeroed spans, anywhere and in the header."""
    path = tmp_path / "a"
    small = {name: tensor for name, tensor in made.tensors.items() if tensor.numel() < 5000}
    checkpoint.save(path, replace(made, tensors=small))
    whole = path.read_bytes()
    count = times(150, 3000)
    for seed in range(count):
        path.write_bytes(damaged(whole, seed, within=6000 if seed % 2 else len(whole)))
        with pytest.raises(UsageError, match="is no checkpoint that can be used"):
            checkpoint.load(path)
    measured("R6", f"{count} damages of a checkpoint, none silent")


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"\x89PNG\r\n\x1a\n" + b"\0" * 99, "its metadata has no sha256"),
        (safetensors.torch.save({"x": torch.ones(2)}), "its metadata has no sha256"),
        (checkpoint.sealed(safetensors.torch.save({}, {"sha256": "0" * 64})), "KeyError('format')"),
        (
            checkpoint.sealed(safetensors.torch.save({}, {"sha256": "0" * 64, "format": "x"})),
            "its format is 'x', not",
        ),
        (checkpoint.sealed(b"\xff" * 8 + b'{"sha256":"' + b"0" * 64 + b'"}'), "KeyError('__metadata__')"),
        (checkpoint.sealed(b"\xff" * 7 + b"\0" + b"[" * 10**5 + b'"sha256":"' + b"0" * 64 + b'"'), "RecursionError("),
    ],
)
def test_other_files_are_refused_by_name(tmp_path, content, message):
    (tmp_path / "a").write_bytes(content)
    with pytest.raises(UsageError, match="a is no checkpoint that can be used") as error:
        checkpoint.load(tmp_path / "a")
    assert message in str(error.value)


def test_what_is_not_there_or_no_file(tmp_path):
    with pytest.raises(UsageError, match="is not there; train first"):
        checkpoint.load(tmp_path / "none")
    with pytest.raises(UsageError, match="cannot be read: it is no regular file"):
        checkpoint.load(tmp_path)
    (tmp_path / "seed-3").mkdir()
    (tmp_path / "seed-3/none").touch()
    with pytest.raises(UsageError, match=r"is not there; name the run of one seed, as .*seed-3"):
        checkpoint.load(tmp_path / "none")


@pytest.mark.parametrize("change", [{"net.extra": torch.ones(1)}, {"net.head.0.weight": torch.ones(2)}])
def test_weights_of_another_network_are_refused(made, change):
    with pytest.raises(UsageError, match=r"weights do not fit its network .*: another version wrote it; train anew"):
        replace(made, tensors=made.tensors | change).network()


def test_features_of_another_version_are_told(made, tmp_path):
    dataset = open_dataset(toy_dataset(tmp_path / "data"))
    older = replace(made, classes=dataset.classes, state={"algorithm_version": 0})
    assert older.clashes(dataset) == ["algorithm version: 0 against 1"]


@pytest.mark.parametrize(
    "change",
    [
        {"task": "x"},
        {"features": ()},
        {"features": ("colour",)},
        {"scaling": "x"},
        {"epochs": 0},
        {"epochs": 10**6 + 1},
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
