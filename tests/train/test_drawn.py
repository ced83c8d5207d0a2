"""Training on a drawn part of each mesh."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
import torch
from packed import pack
from samples import sample, toy_dataset

from meshshard import UsageError, open_dataset
from meshshard_train.config import NORMALISATIONS
from meshshard_train.data import prepare
from meshshard_train.drawn import drawn_part
from meshshard_train.loop import train
from meshshard_train.loss import logits_of, mesh_losses
from meshshard_train.model import TaskDrivenNet
from meshshard_train.recipes import paper

PART = paper("segmentation", vertex_fraction=0.5, rotation_axes="")
SAMPLE = sample(3, level=2)
"""66 vertices and 128 faces."""


@pytest.mark.parametrize("fraction", [0.05, 0.25, 0.5, 0.9])
def test_drawn_faces_are_faces_with_their_labels_and_the_rows_of_their_corners(fraction):
    whole = prepare(SAMPLE, PART)
    part = drawn_part(whole, np.random.default_rng(0), replace(PART, vertex_fraction=fraction))
    assert len(part.faces_F3) == int(fraction * 66) // 3
    assert len(part.features_VC) == len(part.used_V) <= fraction * 66
    assert part.faces_F3.unique().tolist() == list(range(len(part.features_VC)))
    there = {tuple(rows.flatten().tolist()): i for i, rows in enumerate(whole.features_VC[whole.faces_F3])}
    places = [there[tuple(rows.flatten().tolist())] for rows in part.features_VC[part.faces_F3]]
    assert len(set(places)) == len(places)
    assert part.labels.tolist() == whole.labels[places].tolist()
    assert torch.equal(part.areas_V[part.faces_F3], whole.areas_V[whole.faces_F3[places]])


def test_a_network_says_of_drawn_faces_what_it_says_of_them_in_the_whole():
    config = replace(PART, drop_path=0.0)
    torch.manual_seed(0)
    network = TaskDrivenNet(23, 3)
    whole, part = (pack([sample(0), SAMPLE], [0, 1], config, epoch) for epoch in (None, 2))
    logits = [logits_of(network(batch.features_VC), batch, "segmentation") for batch in (whole, part)]
    assert part.mesh_F.bincount().tolist() == [3, 11]
    for mesh, found in zip(part.mesh_F, logits[1], strict=True):
        apart = (logits[0][whole.mesh_F == mesh] - found).abs().amax(1)
        assert apart.min() < 1e-5


def test_over_draws_the_loss_is_that_of_the_whole():
    """Each face is drawn as often as another; so the mean of the losses is the whole's."""
    config, values = replace(PART, vertex_fraction=0.25), torch.linspace(0, 1, 128)
    whole = prepare(SAMPLE, config)
    marked = replace(whole, labels=torch.arange(128))
    draws = [drawn_part(marked, np.random.default_rng(seed), config).labels for seed in range(2000)]
    counts = Counter(torch.cat(draws).tolist())
    assert len(counts) == 128
    expected = 2000 * 5 / 128
    assert max(abs(count - expected) for count in counts.values()) < 5 * np.sqrt(expected)
    means = torch.stack([values[draw].mean() for draw in draws])
    assert means.mean().item() == pytest.approx(0.5, abs=4 * means.std().item() / np.sqrt(2000))


def test_faces_without_a_label_are_drawn_only_where_no_other_is_there():
    whole = prepare(SAMPLE, PART)
    known = torch.arange(128) % 20 == 0
    part = drawn_part(replace(whole, labels=torch.where(known, whole.labels, -1)), np.random.default_rng(0), PART)
    assert part.labels.tolist() == whole.labels[known].tolist()
    nothing = drawn_part(replace(whole, labels=torch.full((128,), -1)), np.random.default_rng(0), PART)
    assert nothing.labels.tolist() == [-1] * 11


@pytest.mark.parametrize("task", ["classification", "vertex_segmentation"])
def test_of_other_tasks_used_vertices_are_drawn(task):
    config = replace(PART, task=task)
    labels = {"mesh_label": 2} if task == "classification" else {"vertex_labels": np.arange(66, dtype="i2")}
    whole = prepare(replace(SAMPLE, **labels), config)
    used_V = torch.arange(66) % 3 > 0
    whole = replace(whole, used_V=used_V)
    if task == "vertex_segmentation":
        whole = replace(whole, labels=torch.where(used_V, whole.labels, -1))
    part = drawn_part(whole, np.random.default_rng(0), config)
    rows = {tuple(row.tolist()): i for i, row in enumerate(whole.features_VC)}
    places = [rows[tuple(row.tolist())] for row in part.features_VC]
    assert len(set(places)) == 33
    assert all(place % 3 > 0 for place in places)
    assert part.used_V.all()
    assert part.labels.tolist() == ([2] if task == "classification" else whole.labels[places].tolist())
    batch = pack([SAMPLE if task == "vertex_segmentation" else replace(SAMPLE, mesh_label=2)], [0], config, 1)
    losses = mesh_losses(logits_of(TaskDrivenNet(23, 3)(batch.features_VC), batch, task), batch, task, 0.0)
    assert losses.isfinite().all()


def test_something_is_always_drawn():
    for task in ("segmentation", "classification"):
        config = paper(task, vertex_fraction=1e-9)
        part = drawn_part(prepare(replace(SAMPLE, mesh_label=0), config), np.random.default_rng(0), config)
        assert len(part.features_VC) == (3 if task == "segmentation" else 1)


def test_evaluation_and_all_of_the_vertices_are_left_whole():
    assert len(pack([SAMPLE], [0], PART, None).features_VC) == 66
    torch.testing.assert_close(
        pack([SAMPLE], [0], replace(PART, vertex_fraction=1.0), 4).features_VC, prepare(SAMPLE, PART).features_VC
    )


def test_convolutions_and_correspondence_refuse_a_part():
    for settings in ({"backbone": "conv"}, {"backbone": "conv_residual"}, {"task": "correspondence"}):
        with pytest.raises(UsageError, match="vertex_fraction below 1 needs a network without convolutions"):
            replace(PART, voting_rounds=0, **settings)


@pytest.mark.parametrize("name", NORMALISATIONS)
def test_normalisation_is_over_what_is_drawn_of_a_mesh(name):
    """Not over what is not, nor over what is packed with it."""
    config = replace(PART, normalisation=name, drop_path=0.0)
    torch.manual_seed(0)
    network = TaskDrivenNet(23, 3, name, width=16)
    alone, packed = pack([SAMPLE], [3], config, 1), pack([SAMPLE, sample(0)], [3, 0], config, 1)
    found = network(packed.features_VC, packed.mesh_V, used_V=packed.used_V)[packed.mesh_V == 0]
    torch.testing.assert_close(found, network(alone.features_VC, used_V=alone.used_V))


def test_passes_go_over_the_meshes_anew_before_they_are_judged(tmp_path):
    """Two epochs of three passes are, but for the rate, six epochs: the same orders and draws."""
    dataset = open_dataset(toy_dataset(tmp_path / "data"))
    settings = {"width": 16, "schedule": "constant", "warmup_epochs": 0.0, "batch_vertices": 100, "precision": "fp32"}
    runs = {}
    for epochs, passes in ((2, 3), (6, 1)):
        config = replace(PART, epochs=epochs, passes=passes, **settings)
        seen = []
        history = train(
            dataset,
            config,
            tmp_path / str(epochs),
            torch.device("cpu"),
            lambda told, seen=seen: seen.append(told.meshes),
        )
        runs[epochs] = history
        assert max(seen) == passes * len(dataset.splits["train"])
    assert [row["epoch"] for row in runs[2]] == [0, 1]
    assert [row["val_accuracy"] for row in runs[2]] == [runs[6][2]["val_accuracy"], runs[6][5]["val_accuracy"]]
    for few, many in ((0, (0, 1, 2)), (1, (3, 4, 5))):
        assert runs[2][few]["loss"] == pytest.approx(np.mean([runs[6][epoch]["loss"] for epoch in many]), rel=1e-6)
