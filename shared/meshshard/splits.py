"""Random splits that can be drawn again: functions of ids, labels, groups and seed, never of the order of meshes."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

SPLITS = ("train", "val", "test")
"""Names of splits that mean something here, in the order in which they are shown."""


@dataclass(frozen=True)
class Member:
    """A mesh as far as splits care. `label`: class of the whole mesh, -1 for none; `group`: meshes that share it must
    not be in two splits, "" for none known."""

    id: str
    label: int = -1
    group: str = ""


def draw_share(members: Sequence[Member], fraction: float, rng: np.random.Generator) -> list[str]:
    """Ids of about `fraction` of the members.

    Where groups are known, whole groups in a drawn order, each that still fits (the smallest, where none does).
    Otherwise class by class, so that every class keeps its share. At least one member is left, and at least one is
    drawn, if there are two.
    """
    members = sorted(members, key=lambda member: member.id)
    if any(member.group for member in members):
        groups = _by(members, [member.group or member.id for member in members])
        room = round(fraction * len(members))
        drawn: list[str] = []
        for number in rng.permutation(len(groups)):
            if len(drawn) + len(groups[number]) <= room:
                drawn += groups[number]
        return drawn or (min(groups, key=len) if len(groups) > 1 else [])
    drawn, passed = [], 0
    for ids in _by(members, [member.label for member in members]):
        passed += len(ids)
        # counted over all classes so far: many small classes together give their share too
        room = max(round(fraction * passed), 1) - len(drawn)
        drawn += [ids[i] for i in rng.permutation(len(ids))[: max(room, 0)]]
    return drawn[: len(members) - 1]


def draw_fractions(members: Sequence[Member], fractions: Mapping[str, float], seed: int) -> dict[str, str]:
    """Id -> split. `fractions`: split -> its share; they sum to 1. The last split takes what the others leave."""
    rng = np.random.default_rng(seed)
    left, share = list(members), 1.0
    splits: dict[str, str] = {}
    *first, last = fractions
    for split in first:
        if fractions[split] >= share - 1e-9:
            drawn = {member.id for member in left}
        else:
            drawn = set(draw_share(left, fractions[split] / share, rng)) if fractions[split] > 0 else set()
        splits |= dict.fromkeys(drawn, split)
        left, share = [member for member in left if member.id not in drawn], share - fractions[split]
    return splits | {member.id: last for member in left}


def draw_per_class(members: Sequence[Member], train: int, seed: int) -> dict[str, str]:
    """Id -> "train" for that many of each class, "test" for the others."""
    rng = np.random.default_rng(seed)
    members = sorted(members, key=lambda member: member.id)
    splits = dict.fromkeys((member.id for member in members), "test")
    for ids in _by(members, [member.label for member in members]):
        splits |= {ids[i]: "train" for i in rng.permutation(len(ids))[:train]}
    return splits


def draw_folds(members: Sequence[Member], folds: int, seed: int) -> dict[str, int]:
    """Id -> fold, 0 to folds - 1. Whole groups where groups are known, the largest first, each into the smallest
    fold; otherwise class by class, in turn: folds of equal size, each with every class's share."""
    rng = np.random.default_rng(seed)
    members = sorted(members, key=lambda member: member.id)
    if any(member.group for member in members):
        groups = _by(members, [member.group or member.id for member in members])
        groups = sorted((groups[i] for i in rng.permutation(len(groups))), key=len, reverse=True)
        sizes = [0] * folds
        found: dict[str, int] = {}
        for ids in groups:
            fold = sizes.index(min(sizes))
            sizes[fold] += len(ids)
            found |= dict.fromkeys(ids, fold)
        return found
    by_class = _by(members, [member.label for member in members])
    order = [ids[i] for ids in by_class for i in rng.permutation(len(ids))]
    return {name: place % folds for place, name in enumerate(order)}


def few_shot(members: Sequence[Member], fraction: float, seed: int) -> frozenset[str]:
    """Ids of `fraction` of the members, at least one: nested, so that the tenth of a seed holds its hundredth.

    Classes keep their shares as far as the number allows; among meshes without a class, groups do.
    """
    rng = np.random.default_rng(seed)
    members = sorted(members, key=lambda member: member.id)
    ranked = []
    for ids in _by(members, [member.group if member.label < 0 else member.label for member in members]):
        places = rng.permutation(len(ids))
        # rank within the class over its size: a prefix of the whole order takes the same share of each class
        ranked += [((place + rng.random()) / len(ids), name) for place, name in zip(places, ids, strict=True)]
    return frozenset(name for _, name in sorted(ranked)[: max(round(fraction * len(members)), 1)])


def _by(members: Sequence[Member], names: Sequence[str | int]) -> list[list[str]]:
    """Ids of members that share a name, in the order of the names."""
    found: dict[str | int, list[str]] = defaultdict(list)
    for member, name in zip(members, names, strict=True):
        found[name].append(member.id)
    return [found[name] for name in sorted(found, key=str)]
