"""Class of every face, vertex or mesh, from a network and samples."""

from collections.abc import Iterator, Sequence

import numpy as np
import torch
from jaxtyping import Float, Int
from torch import Tensor

from meshshard import UsageError
from meshshard_train.data import Batch
from meshshard_train.device import autocast
from meshshard_train.loading import Meshes
from meshshard_train.loss import logits_of
from meshshard_train.model import TaskDrivenNet


def predictions(
    network: TaskDrivenNet, meshes: Meshes, numbers: Sequence[int]
) -> Iterator[tuple[int, Int[np.ndarray, " n"], Float[np.ndarray, "n K"]]]:
    """(number, classes, probabilities) of each sample: a row for each face or vertex, or one row for the mesh.
    UsageError: the network gives no finite numbers for one, because its training diverged."""
    network.eval()
    task = meshes.config.task
    for batch in meshes.evaluation_batches(numbers):
        with torch.inference_mode(), autocast(meshes.config.precision, meshes.device):
            logits = logits_of(network(*batch.network_inputs), batch, task)
            probabilities = logits.float().softmax(1).cpu()
        for number, rows in zip(batch.numbers, _per_mesh(probabilities, batch, task), strict=True):
            if not rows.isfinite().all():
                raise UsageError(
                    f"the network's outputs for {meshes.dataset.ids[number]} are not finite: its training diverged; "
                    "train anew, in another --run, with a lower --learning-rate"
                )
            yield number, rows.argmax(1).numpy(), rows.numpy()


def _per_mesh(rows: Tensor, batch: Batch, task: str) -> tuple[Tensor, ...]:
    if task == "classification":
        return rows.split(1)
    mesh_n = batch.mesh_F if task == "segmentation" else batch.mesh_V
    return rows.split(torch.bincount(mesh_n, minlength=len(batch.numbers)).tolist())
