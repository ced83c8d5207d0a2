"""The task correspondence from shards to figures."""

import json
from dataclasses import replace

import pytest
import torch
from matched import matched_dataset, matched_sample
from samples import PAPER, toy_dataset, write_dataset
from typer.testing import CliRunner

from meshshard import UsageError, open_dataset
from meshshard.cli import app
from meshshard_train import checkpoint, loop
from meshshard_train.data import collate, prepare, steps_of
from meshshard_train.loading import Loading, Meshes
from meshshard_train.loop import train
from meshshard_train.loss import logits_of, mesh_losses
from meshshard_train.matching import evaluate_matching
from meshshard_train.model import TaskDrivenNet
from meshshard_train.pairs import partners, together
from meshshard_train.recipes import paper
from meshshard_train.results import write_results
from meshshard_train.tasks import check_task, task_of

CPU = torch.device("cpu")
CONFIG = paper(
    "correspondence", width=16, eigenfunctions=10, epochs=2, warmup_epochs=1.0, batch_meshes=2, precision="fp32"
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return matched_dataset(tmp_path_factory.mktemp("matched"))


@pytest.fixture(scope="module")
def dataset(folder):
    return open_dataset(folder)


@pytest.fixture(scope="module")
def unbroken(dataset, tmp_path_factory):
    """The folder and history of a run of CONFIG that nothing stopped."""
    run = tmp_path_factory.mktemp("unbroken") / "run"
    return run, train(dataset, CONFIG, run, CPU)


def numbers_of(history):
    return [{k: v for k, v in row.items() if k not in ("seconds", "waited")} for row in history]


def test_packed_pairs_are_one_by_one(dataset):
    """Meshes of different size, one of them in several pairs, drop-path included: gradients agree to 1e-6."""
    config = replace(CONFIG, drop_path=0.5, rotation_axes="xyz")
    torch.manual_seed(0)
    network = TaskDrivenNet(23, config.coordinates).double()
    with torch.no_grad():
        for name, parameter in network.named_parameters():
            if name.endswith("gamma"):
                parameter.fill_(0.5)
    numbers = dataset.splits["train"]
    partner = partners(numbers, config.seed, epoch := 4)
    assert len(set(partner.values())) < len(numbers)  # one is the second of several

    def gradients(plan):
        network.zero_grad()
        for firsts in plan:
            packed, pairs = together(firsts, partner)
            batch = collate([prepare(dataset[n], config) for n in packed], packed, config, epoch, pairs)
            assert batch.of_losses == tuple((first, partner[first]) for first in firsts)
            batch = replace(batch, features_VC=batch.features_VC.double(), drop_BL=batch.drop_BL.double())
            logits = logits_of(network(batch.features_VC, batch.mesh_V, batch.vertex_drops), batch, config.task)
            losses = mesh_losses(logits, batch, config.task, 0.0, config.map_regularisation)
            assert losses.shape == (len(firsts),)
            (losses.sum() / len(numbers)).backward()
        return torch.cat([p.grad.flatten() for p in network.parameters()])

    whole, alone = gradients([list(numbers)]), gradients([[number] for number in numbers])
    assert (whole - alone).abs().max() < 1e-6 * whole.abs().max()


def test_kept_and_streamed_batches_are_the_same(dataset):
    plan = steps_of(dataset.splits["train"], dataset.vertex_counts, CONFIG, 1)
    kept, streamed = (
        list(Meshes(dataset, CONFIG, CPU, loading).batches(plan, 1)) for loading in (Loading(), Loading(keep_gib=0.0))
    )
    assert [batch.of_losses for batch in kept] == [batch.of_losses for batch in streamed]
    for one, other in zip(kept, streamed, strict=True):
        assert torch.equal(one.features_VC, other.features_VC)
        for a, b in zip(one.spectra, other.spectra, strict=True):
            assert torch.equal(a.eigenfunctions_VK, b.eigenfunctions_VK)
            assert torch.equal(a.points_M, b.points_M)
        firsts = [first for first, _ in one.of_losses]
        assert firsts in plan


def test_it_learns(dataset, tmp_path):
    config = replace(CONFIG, epochs=6, batch_meshes=1, rotation_axes="", drop_path=0.0)
    history = train(dataset, config, tmp_path / "run", CPU)
    assert history[-1]["loss"] < 0.8 * history[0]["loss"]
    torch.manual_seed(config.seed)
    network = checkpoint.network_for(config, 16, 0)
    before = evaluate_matching(network, Meshes(dataset, config, CPU, Loading()), dataset.splits["val"]).mean()
    assert min(row["val_geodesic_error"] for row in history) < 0.8 * before
    best = checkpoint.load(tmp_path / "run" / "best.safetensors")
    assert best.state["score"] == -min(row["val_geodesic_error"] for row in history)


def test_stopped_within_an_epoch_it_goes_on_to_the_bit(dataset, tmp_path, unbroken, monkeypatch):
    monkeypatch.setattr(loop, "SAVE_SECONDS", 0.0)
    calls = 0

    def kill(_):
        nonlocal calls
        calls += 1
        if calls == 5:  # epoch 0 has two steps and its end, then comes the first step of epoch 1
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        train(dataset, CONFIG, tmp_path / "killed", CPU, kill)
    resumed = train(dataset, CONFIG, tmp_path / "killed", CPU)
    run, whole = unbroken
    assert numbers_of(resumed) == numbers_of(whole)
    a, b = (checkpoint.load(place / "last.safetensors").tensors for place in (run, tmp_path / "killed"))
    assert all(torch.equal(a[name], b[name]) for name in a)


def test_results(dataset, unbroken):
    run, history = unbroken
    results, pictures = write_results(dataset, run, history, CPU)
    assert json.loads((run / "results.json").read_text()) == results
    assert list(results["rows"]) == ["val", "test"]
    best = min(history, key=lambda row: row["val_geodesic_error"])
    assert results["rows"]["val"]["geodesic_error"] == best["val_geodesic_error"]
    for row in results["rows"].values():
        assert len(row["shares"]) == len(results["thresholds"])
        assert row["shares"] == sorted(row["shares"])
        assert row["points"] == 2 * 18
    assert "| split | mean error |" in (run / "results.md").read_text()
    assert [path.name for path in pictures] == ["curves.png"]
    assert pictures[0].read_bytes().startswith(b"\x89PNG")


def test_the_published_choice_of_the_epoch(dataset, tmp_path):
    config = replace(CONFIG, selection="test", epochs=1)
    history = train(dataset, config, tmp_path / "run", CPU)
    assert "test_geodesic_error" in history[0]
    results, _ = write_results(dataset, tmp_path / "run", history, CPU)
    assert list(results["rows"]) == ["test"]
    assert "TEST" in results["protocol"]


def test_a_loss_that_is_not_finite_names_both_meshes(dataset, tmp_path, monkeypatch):
    original = loop.mesh_losses
    monkeypatch.setattr(loop, "mesh_losses", lambda *a: original(*a) * float("nan"))
    with pytest.raises(UsageError, match=r"the loss is not finite on \['mesh00.', 'mesh00.'\]"):
        train(dataset, replace(CONFIG, batch_meshes=1), tmp_path / "run", CPU)


def test_commands(folder, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    settings = ["--set", "width=16", "--set", "eigenfunctions=10", "--epochs", "1", "--precision", "fp32"]
    told = CliRunner().invoke(app, ["train", str(folder), "--run", "run", *settings])
    assert told.exit_code == 0, told.output
    assert "val geodesic error" in told.output
    assert "curves.png" in told.output
    judged = CliRunner().invoke(app, ["evaluate", "run", "--split", "val", "--json"])
    assert judged.exit_code == 0, judged.output
    results = json.loads((tmp_path / "run" / "results.json").read_text())
    assert json.loads(judged.stdout)["rows"]["val"] == results["rows"]["val"]
    shown = CliRunner().invoke(app, ["evaluate", "run"])
    assert f"{100 * results['rows']['test']['geodesic_error']:.2f}" in shown.output
    refused = CliRunner().invoke(app, ["predict", "run", str(folder)])
    assert refused.exit_code != 0


def test_data_without_what_it_needs_is_refused_by_name(tmp_path, folder):
    dataset = open_dataset(folder)
    assert task_of(dataset) == "correspondence"
    check_task(dataset, CONFIG)
    with pytest.raises(UsageError, match=r"has 10 eigenpairs .* need 30: .* meshshard features toy --spectrum 30"):
        check_task(dataset, paper("correspondence"))
    sample = matched_sample(0)
    without = write_dataset(
        tmp_path / "a",
        [replace(sample, correspondence=None)],
        ["train"],
        task="correspondence",
        classes=(),
        recipe=replace(PAPER, spectrum=10),
    )
    with pytest.raises(UsageError, match="has shards without correspondence, the vertex of each mesh"):
        check_task(open_dataset(without), CONFIG)
    with pytest.raises(UsageError, match="is a data set for segmentation, the run is for correspondence"):
        check_task(open_dataset(toy_dataset(tmp_path / "b")), CONFIG)


def test_one_training_mesh_is_refused(tmp_path):
    folder = matched_dataset(tmp_path / "a", splits=("train", "val", "val"))
    with pytest.raises(UsageError, match="between two meshes, and there is 1 to train with"):
        train(open_dataset(folder), CONFIG, tmp_path / "run", CPU)
