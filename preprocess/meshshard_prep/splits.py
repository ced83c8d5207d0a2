"""The split that each mesh is trained or tested in: the data set's own, and a validation split drawn from train."""

import numpy as np

from meshshard.copies import original_id
from meshshard.splits import Member, draw_share, few_shot
from meshshard_prep.datasets.layout import RawDataset


def assign_splits(dataset: RawDataset, *, fraction: float, seed: int, train_fraction: float = 1.0) -> dict[str, str]:
    """Id -> split to train with: the data set's, and where it has no validation split, about `fraction` of train.

    With a `train_fraction` below 1, only that share of what is left of train stays in it, nested by seed; the rest is
    in no split (""). The result depends on ids, groups, classes and seed, never on the order of entries. Deformed
    copies are in train with their originals, or in no split.
    """
    splits = dataset.splits
    originals = [entry for entry in dataset.entries if not entry.deformed]
    members = {entry.id: Member(entry.id, entry.mesh_label, entry.group) for entry in originals}
    train = [member for name, member in members.items() if splits[name] == "train"]
    if fraction > 0 and train and "val" not in splits.values():
        splits |= dict.fromkeys(draw_share(train, fraction, np.random.default_rng(seed)), "val")
    left = [member for name, member in members.items() if splits[name] == "train"]
    if train_fraction < 1 and left:
        kept = few_shot(left, train_fraction, seed)
        splits |= {member.id: "" for member in left if member.id not in kept}
    copies = [entry.id for entry in dataset.entries if entry.deformed]
    return splits | {name: "train" if splits[original_id(name)] == "train" else "" for name in copies}
