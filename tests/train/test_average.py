"""The moving average of the weights, and the clipping of gradients, against their definitions."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from samples import toy_dataset
from training import CONFIG, CPU, train_here

from meshshard import UsageError, open_dataset
from meshshard_train import checkpoint, loop
from meshshard_train.evaluate import evaluate
from meshshard_train.loading import Loading, Meshes
from meshshard_train.schedule import best_epoch
from meshshard_train.state import State

NAMES = ("stem1.0.weight", "encoder.1.blocks.2.gamma", "head.3.bias")


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    return toy_dataset(tmp_path_factory.mktemp("average") / "data")


@pytest.fixture
def steps(monkeypatch):
    """Weights and gradients of the network after each step, the weights before the first one in front."""
    seen, original = [], State.follow

    def follow(state, decay):
        named = dict(state.network.named_parameters())
        seen.append({name: (p.detach().clone(), p.grad.clone()) for name, p in named.items()})
        original(state, decay)

    monkeypatch.setattr(State, "follow", follow)
    return seen


def test_the_average_is_the_sum_of_all_weights_by_their_shares(data, tmp_path, steps):
    """The share of a step is what it entered with, times what each later step left of it. Decays of the first steps
    are at most 1/10, 2/11, 3/12, ..."""
    decay = 0.2
    config = replace(CONFIG, ema=decay)
    torch.manual_seed(config.seed)
    first = checkpoint.network_for(config, 16, 3).state_dict()
    history = train_here(data, tmp_path / "run", config)
    decays = [min(decay, (1 + step) / (10 + step)) for step in range(len(steps))]
    shares = [np.prod(decays)] + [(1 - d) * np.prod(decays[i + 1 :]) for i, d in enumerate(decays)]
    assert sum(shares) == pytest.approx(1)
    last = checkpoint.load(tmp_path / "run" / "last.safetensors").tensors
    best = checkpoint.load(tmp_path / "run" / "best.safetensors")
    for name in NAMES:
        weights = [first[name], *(step[name][0] for step in steps)]
        average = sum(share * weight.double() for share, weight in zip(shares, weights, strict=True))
        torch.testing.assert_close(last[f"avg.{name}"].double(), average, rtol=1e-5, atol=1e-7)
        torch.testing.assert_close(last[f"net.{name}"], weights[-1], rtol=0, atol=0)
    assert best_epoch(history) == best.state["epoch"] == config.epochs - 1
    assert all(torch.equal(best.tensors[f"net.{name}"], last[f"avg.{name}"]) for name in NAMES)
    dataset = open_dataset(data)
    found = evaluate(best.network(), Meshes(dataset, config, CPU, Loading()), dataset.splits["val"])
    assert history[-1]["val_accuracy"] == found.raw.accuracy()


def test_gradients_are_shortened_to_the_norm_and_no_further(data, tmp_path, steps):
    config = replace(CONFIG, epochs=1, passes=1, batch_vertices=10**6, ema=0.0)
    for number, norm in enumerate((0.0, 1e-3, 1e6)):
        train_here(data, tmp_path / f"{number}", replace(config, clip_norm=norm))
    free, clipped, loose = ({name: gradient for name, (_, gradient) in step.items()} for step in steps)
    length = sum(float(gradient.double().square().sum()) for gradient in free.values()) ** 0.5
    assert length > 1e-3
    for name, gradient in free.items():
        torch.testing.assert_close(clipped[name], gradient * 1e-3 / length, rtol=1e-3, atol=0)
        assert torch.equal(loose[name], gradient)


def test_a_gradient_that_is_not_finite_stops_before_anything_is_changed(data, tmp_path, monkeypatch):
    """The loss is 0, and the slope of the root there is not finite."""
    original = loop.mesh_losses
    monkeypatch.setattr(loop, "mesh_losses", lambda *a: (original(*a) * 0).sqrt())
    with pytest.raises(UsageError, match=r"epoch 0: the gradient of the loss is not finite on \['mesh00"):
        train_here(data, tmp_path / "run")
    assert [path.name for path in (tmp_path / "run").iterdir()] == ["config.json"]
