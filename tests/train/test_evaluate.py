from dataclasses import dataclass

import numpy as np
import pytest
import torch
from samples import sample, toy_dataset, write_dataset

from meshshard import open_dataset
from meshshard_train import evaluate as module
from meshshard_train.checkpoint import network_for
from meshshard_train.evaluate import evaluate
from meshshard_train.loading import Loading, Meshes
from meshshard_train.metrics import FIGURES
from meshshard_train.recipes import paper
from meshshard_train.tasks import labels_of
from meshshard_train.team import Team

CPU = torch.device("cpu")


def of_vertices(number):
    """A sample whose vertices are labelled by height, every fifth one not."""
    made = sample(number, labels=None, label_domain="vertex")
    labels = np.digitize(made.vertices[:, 1], [-0.3, 0.3]).astype("i2")
    labels[::5] = -1
    return sample(number, labels=None, vertex_labels=labels, label_domain="vertex")


def predicted(network, meshes, numbers):  # noqa: ARG001  as of `predictions`
    """Classes that no network would find, but of every kind."""
    for number in numbers:
        count = len(labels_of(meshes.dataset[number], meshes.config.task))
        yield number, np.random.default_rng(number).integers(0, 3, count), np.zeros((count, 3))


@pytest.fixture(params=["segmentation", "vertex_segmentation"])
def world(request, tmp_path, monkeypatch):
    """A network, meshes, and the numbers of some."""
    if request.param == "segmentation":
        dataset = open_dataset(toy_dataset(tmp_path / "data"))
    else:
        dataset = open_dataset(write_dataset(tmp_path / "data", map(of_vertices, range(5)), ["train"] * 5))
    config = paper(request.param, width=16, precision="fp32")
    monkeypatch.setattr(module, "predictions", predicted)
    return network_for(config, len(dataset.recipe.times), 3), Meshes(dataset, config, CPU, Loading()), range(5)


def test_counts_are_those_of_the_predictions_and_of_votes_by_hand(world):
    network, meshes, numbers = world
    task = meshes.config.task
    found = evaluate(network, meshes, numbers, [0, 1])
    raw = voted = total = 0
    for number, labels, _ in predicted(network, meshes, numbers):
        made = meshes.dataset[number]
        faces = made.faces.tolist()
        truth = made.face_labels if task == "segmentation" else made.vertex_labels
        for place, true in enumerate(truth):
            if task == "segmentation":
                near = [i for i, other in enumerate(faces) if set(other) & set(faces[place])]
            else:
                near = sorted(set().union({place}, *(face for face in faces if place in face)))
            total += true >= 0
            raw += true == labels[place]
            voted += true == np.bincount(labels[near]).argmax()
    assert (found.raw.accuracy(), found.voted[1].accuracy()) == (raw / total, voted / total)
    assert raw != voted
    row = found.row(1)
    names = FIGURES[task]
    assert list(row) == [*names, *(f"voted_{name}" for name in names)]
    assert ("edge_accuracy" in row) == (task == "segmentation")
    assert not any(np.isnan(value) for value in row.values())
    assert found.row(0)["voted_mean_iou"] == row["mean_iou"]


@dataclass(frozen=True)
class Heard(Team):
    """A process that hears from others what they have counted."""

    others: tuple = ()

    def gather(self, value):
        return [value, *self.others]


@pytest.mark.parametrize("size", [2, 7])
def test_a_team_counts_what_one_process_counts(world, size):
    network, meshes, numbers = world
    alone = evaluate(network, meshes, numbers, [0, 2])
    others = tuple(evaluate(network, meshes, numbers, [0, 2], Heard(rank, size)) for rank in range(1, size))
    together = evaluate(network, meshes, numbers, [0, 2], Heard(0, size, others))
    assert together.row(2) == pytest.approx(alone.row(2), rel=1e-12)
    assert np.array_equal(together.voted[2].counts, alone.voted[2].counts)
