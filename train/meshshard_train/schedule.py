"""The learning rate over epochs, and when a run ends."""

import math
from collections.abc import Sequence
from typing import Any

from meshshard_train.config import TrainConfig


def learning_rate(config: TrainConfig, epoch: float) -> float:
    """Linear warm-up from a thousandth, for at most a third of the schedule; then a cosine to 0 at the last epoch, or
    constant. `epoch` counts in fractions."""
    warmup = min(config.warmup_epochs, config.epochs / 3)
    if epoch < warmup:
        return config.learning_rate * (1e-3 + (1 - 1e-3) * epoch / warmup)
    if config.schedule == "constant":
        return config.learning_rate
    return config.learning_rate * 0.5 * (1 + math.cos(math.pi * (epoch - warmup) / (config.epochs - warmup)))


def best_epoch(history: Sequence[dict[str, Any]]) -> int:
    """The epoch with the highest score, the last of equals, which has learned most; -1 without any."""
    return max(range(len(history)), key=lambda epoch: (history[epoch]["score"], epoch), default=-1)


def is_over(config: TrainConfig, history: Sequence[dict[str, Any]]) -> bool:
    """All epochs are done, or the last `patience` of them brought no better one."""
    scores = [row["score"] for row in history]
    waited = len(scores) - 1 - scores.index(max(scores)) if scores else 0
    return len(scores) >= config.epochs or 0 < config.patience <= waited
