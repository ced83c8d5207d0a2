"""Which meshes of a data set a run trains on and is judged by."""

from collections.abc import Sequence

import numpy as np

from meshshard import Dataset, UsageError
from meshshard.copies import original_id
from meshshard.splits import Member, few_shot
from meshshard_train.config import TrainConfig
from meshshard_train.tasks import labels_of


def training_numbers(dataset: Dataset, config: TrainConfig) -> Sequence[int]:
    """The training split, or of it the fraction of few-shot learning: nested for one seed; classes of meshes keep
    their shares, and where only parts have classes, groups do (a subject, a sequence). Deformed copies come with
    their originals.

    Where the test split chooses, as published, nothing else would use the validation split: it is trained on too.
    """
    numbers = list(split_of(dataset, "train"))
    if config.selection == "test":
        numbers = sorted([*numbers, *dataset.splits.get("val", ())])
    if config.train_fraction == 1:
        return numbers
    originals = {original_id(dataset.ids[number]): number for number in numbers}
    originals |= {dataset.ids[number]: number for number in numbers if dataset.ids[number] in originals}
    samples = {name: dataset[number] for name, number in originals.items()}
    members = [Member(name, sample.mesh_label, sample.group) for name, sample in samples.items()]
    kept = few_shot(members, config.train_fraction, config.seed)
    return [number for number in numbers if original_id(dataset.ids[number]) in kept]


JUDGES = {"validation": "val", "test": "test"}
"""Configuration's `selection` -> the split that chooses the epoch."""


def judging_numbers(dataset: Dataset, config: TrainConfig) -> Sequence[int]:
    """The split that chooses the epoch. UsageError: it is empty, or nothing in it has a label."""
    name = JUDGES[config.selection]
    numbers = split_of(dataset, name)
    if config.task != "correspondence" and not any((labels_of(dataset[n], config.task) >= 0).any() for n in numbers):
        raise UsageError(
            f"{dataset.folder}: nothing in the split {name!r} has a label, and it chooses the epoch; label some of "
            "its meshes, or choose others (docs/datasets.md)"
        )
    return numbers


def keys_of(dataset: Dataset, numbers: Sequence[int]) -> list[str]:
    """What identifies meshes in any data set and under any name: the first 16 digits of their cache keys."""
    return [dataset.index.keys[number][:16] for number in numbers]


def split_of(dataset: Dataset, name: str) -> Sequence[int]:
    """The meshes of a split. UsageError: there are none."""
    numbers = dataset.splits.get(name, ())
    if not numbers:
        there = ", ".join(f"{split or '(none)'}: {len(members)}" for split, members in dataset.splits.items())
        raise UsageError(
            f"{dataset.folder} has no meshes in the split {name!r} ({there}); training needs train and val, or test "
            "where that chooses. Meshes in a folder train/ are for training, or those that [splits] of the data "
            "set's TOML file names or draws (docs/datasets.md); part of train becomes val: "
            "meshshard features --val-fraction"
        )
    return numbers


def classes_without(dataset: Dataset, numbers: Sequence[int], task: str) -> list[str]:
    """Classes that none of the meshes has: a network cannot learn them."""
    if task == "correspondence":
        return []
    counts = np.zeros(len(dataset.classes), dtype=np.int64)
    for number in numbers:
        labels = labels_of(dataset[number], task)
        counts += np.bincount(labels[labels >= 0], minlength=len(counts))
    return [name for name, count in zip(dataset.classes, counts, strict=True) if count == 0]
