from dataclasses import replace

import numpy as np
import pytest
import torch
from packed import pack
from samples import sample

from meshshard_train.loss import logits_of, mesh_losses
from meshshard_train.model import TaskDrivenNet
from meshshard_train.recipes import paper


def gradients(network, batches, config):
    """Summed over batches, each weighted by its share of the meshes."""
    meshes = sum(len(batch.numbers) for batch in batches)
    network.zero_grad()
    for batch in batches:
        logits = logits_of(network(batch.features_VC, batch.mesh_V, batch.vertex_drops), batch, config.task)
        (mesh_losses(logits, batch, config.task, config.label_smoothing).sum() / meshes).backward()
    return torch.cat([p.grad.flatten() for p in network.parameters()])


@pytest.mark.parametrize("task", ["segmentation", "classification"])
def test_packed_is_one_by_one(task):
    """Meshes of different size, drop-path included: gradients agree to 1e-6 of their size, in double precision."""
    config = paper(task, drop_path=0.5)
    samples = [sample(n, level=n % 3, mesh_label=n % 3) for n in range(5)]
    torch.manual_seed(0)
    network = TaskDrivenNet(23, 3).double()
    with torch.no_grad():
        for name, parameter in network.named_parameters():
            if name.endswith("gamma"):
                parameter.fill_(0.5)

    def double(batch):
        return replace(batch, features_VC=batch.features_VC.double(), drop_BL=batch.drop_BL.double())

    together = gradients(network, [double(pack(samples, range(5), config, 7))], config)
    alone = gradients(network, [double(pack([s], [n], config, 7)) for n, s in enumerate(samples)], config)
    assert (together - alone).abs().max() < 1e-6 * together.abs().max()


def test_every_mesh_weighs_the_same_and_unlabelled_faces_nothing():
    config = paper("segmentation", label_smoothing=0.0)
    labels = np.array([-1, 0, 1, -1, -1, -1, -1, -1], dtype="i2")
    samples = [sample(0, level=0, face_labels=labels), sample(1), sample(2, level=0, face_labels=labels * 0 - 1)]
    batch = pack(samples, range(3), config, None)
    logits = torch.randn(len(batch.labels), 3)
    losses = mesh_losses(logits, batch, "segmentation", 0.0)
    log = logits.log_softmax(1)
    assert losses[0].item() == pytest.approx(-(log[1, 0] + log[2, 1]).item() / 2, rel=1e-5)
    picked = log[8:40][torch.arange(32), batch.labels[8:40]]
    assert losses[1].item() == pytest.approx(-picked.mean().item(), rel=1e-5)
    assert losses[2].item() == 0


def test_label_smoothing_is_torchs():
    config = paper("classification")
    samples = [sample(n, mesh_label=n) for n in range(3)]
    batch = pack(samples, range(3), config, None)
    logits = torch.randn(3, 3)
    expected = -(0.9 * logits.log_softmax(1)[range(3), range(3)] + 0.1 * logits.log_softmax(1).mean(1))
    torch.testing.assert_close(mesh_losses(logits, batch, "classification", 0.1), expected)
