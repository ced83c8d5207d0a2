"""Batches straight from samples."""

from meshshard_train.data import collate, prepare


def pack(samples, numbers, config, epoch):
    """The batch of these samples; augmented with an epoch."""
    return collate([prepare(sample, config) for sample in samples], numbers, config, epoch)
