"""A validation split drawn from train by a seed, whole groups at a time."""

from collections import defaultdict
from collections.abc import Sequence

import numpy as np

from meshshard_prep.datasets.layout import Entry


def assign_splits(entries: Sequence[Entry], *, fraction: float, seed: int) -> dict[str, str]:
    """Id -> split to train with: as shipped, and where no validation split is shipped, about `fraction` of train.

    Where groups are known, whole groups are taken in a drawn order, each that still fits (the smallest, where none
    does): no frame of a sequence is in train while its neighbour is in validation. Otherwise meshes are drawn class
    by class, so that every class keeps its share. At least one mesh is taken, and at least one stays. The result
    depends on ids, groups, classes and seed, never on the order of entries.
    """
    splits = {entry.id: entry.split for entry in entries}
    train = sorted((entry for entry in entries if entry.split == "train"), key=lambda entry: entry.id)
    if fraction > 0 and train and "val" not in splits.values():
        splits |= dict.fromkeys(_drawn(train, fraction, np.random.default_rng(seed)), "val")
    return splits


def _drawn(train: list[Entry], fraction: float, rng: np.random.Generator) -> list[str]:
    if any(entry.group for entry in train):
        groups = _by(train, [entry.group or entry.id for entry in train])
        room = round(fraction * len(train))
        drawn: list[str] = []
        for number in rng.permutation(len(groups)):
            if len(drawn) + len(groups[number]) <= room:
                drawn += groups[number]
        return drawn or (min(groups, key=len) if len(groups) > 1 else [])
    drawn, passed = [], 0
    for members in _by(train, [entry.mesh_label for entry in train]):
        passed += len(members)
        # counted over all classes so far: many small classes together give their share too
        room = max(round(fraction * passed), 1) - len(drawn)
        drawn += [members[i] for i in rng.permutation(len(members))[: max(room, 0)]]
    return drawn if len(drawn) < len(train) else []


def _by(entries: list[Entry], names: Sequence[str | int]) -> list[list[str]]:
    """Ids of entries that share a name, in the order of the names."""
    members: dict[str | int, list[str]] = defaultdict(list)
    for entry, name in zip(entries, names, strict=True):
        members[name].append(entry.id)
    return [members[name] for name in sorted(members, key=str)]
