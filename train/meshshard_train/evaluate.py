"""How right a network is on a split: raw, and after voting."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch

from meshshard import Dataset, UsageError
from meshshard_train.config import TrainConfig
from meshshard_train.metrics import Confusion
from meshshard_train.model import TaskDrivenNet
from meshshard_train.predict import predictions
from meshshard_train.voting import vote

VOTING_ROUNDS = (0, 1, 2, 3, 5, 8, 12, 20)
"""Rounds among which the validation split chooses."""


@dataclass(frozen=True, kw_only=True)
class Evaluation:
    """Results of one split: raw, and voted by rounds. Classification has no faces to vote and only `raw`."""

    raw: Confusion
    voted: dict[int, Confusion]

    def best_rounds(self) -> int:
        """Rounds with the highest accuracy, the fewest of equals; 0 when raw is best."""
        return max(self.voted, key=lambda rounds: (self.voted[rounds].accuracy(), -rounds), default=0)

    def row(self, rounds: int) -> dict[str, float]:
        """One row of the results table: raw figures, and voted ones with the prefix; accuracy alone where there are
        no faces to weigh or to vote."""
        if not self.voted:
            return {"accuracy": self.raw.accuracy()}
        voted = self.voted[rounds]
        return self.raw.summary() | {f"voted_{name}": value for name, value in voted.summary().items()}


def evaluate(
    network: TaskDrivenNet,
    dataset: Dataset,
    numbers: Sequence[int],
    config: TrainConfig,
    device: torch.device,
    rounds: Sequence[int] = VOTING_ROUNDS,
) -> Evaluation:
    """Predict every sample of `numbers` and count. UsageError for an empty split."""
    if not numbers:
        raise UsageError(f"{dataset.folder}: the split to evaluate is empty; there are {', '.join(dataset.splits)}")
    segmentation = config.task == "segmentation"
    raw = Confusion(len(dataset.classes))
    voted = {count: Confusion(len(dataset.classes)) for count in rounds} if segmentation else {}
    for number, labels, _ in predictions(network, dataset, numbers, config, device):
        sample = dataset[number]
        if not segmentation:
            raw.add(np.array([sample.mesh_label]), labels)
            continue
        assert sample.face_labels is not None
        raw.add(sample.face_labels, labels, sample.face_areas)
        done = 0
        for count in sorted(voted):
            labels, done = vote(labels, sample.faces, count - done), count
            voted[count].add(sample.face_labels, labels, sample.face_areas)
    return Evaluation(raw=raw, voted=voted)
