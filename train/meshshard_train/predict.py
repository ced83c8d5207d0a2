"""Class of every face, or of every mesh, from a network and samples."""

from collections.abc import Iterator, Sequence

import numpy as np
import torch
from jaxtyping import Float, Int
from torch import Tensor

from meshshard import Dataset
from meshshard_train.config import TrainConfig
from meshshard_train.data import Batch, evaluation_batches
from meshshard_train.device import autocast
from meshshard_train.loss import logits_of
from meshshard_train.model import TaskDrivenNet


def predictions(
    network: TaskDrivenNet, dataset: Dataset, numbers: Sequence[int], config: TrainConfig, device: torch.device
) -> Iterator[tuple[int, Int[np.ndarray, " n"], Float[np.ndarray, "n K"]]]:
    """(number, classes, probabilities) of each sample: a row for each face, or one row for classification."""
    network.eval()
    for batch in evaluation_batches(dataset, numbers, config):
        on_device = batch.to(device)
        with torch.inference_mode(), autocast(config.precision, device):
            logits = logits_of(network(on_device.features_VC), on_device, config.task)
            probabilities = logits.float().softmax(1).cpu()
        for number, rows in zip(batch.numbers, _per_mesh(probabilities, batch, config), strict=True):
            yield number, rows.argmax(1).numpy(), rows.numpy()


def _per_mesh(rows: Tensor, batch: Batch, config: TrainConfig) -> tuple[Tensor, ...]:
    if config.task == "classification":
        return rows.split(1)
    return rows.split(torch.bincount(batch.mesh_F, minlength=len(batch.numbers)).tolist())
