"""Splits that adapters draw: functions of ids, classes, folds and seed, never of the order of meshes."""

from collections.abc import Callable
from dataclasses import replace

from meshshard.errors import UsageError
from meshshard.splits import Member, draw_fractions, draw_per_class
from meshshard_prep.datasets.layout import Draw, Entry, RawDataset

Split = Callable[[RawDataset, Draw], RawDataset]


def class_of(entry: Entry) -> str:
    """The class of a whole mesh, as a name."""
    return str(entry.mesh_label)


def folder_of(entry: Entry) -> str:
    """The folder on top that a mesh lies in, where several sets make one data set."""
    return entry.id.split("/")[0] if "/" in entry.id else ""


def per_class(train: int, kind: Callable[[Entry], str] = class_of) -> Split:
    """`train` meshes of each kind for train, the others for test."""

    def split(found: RawDataset, draw: Draw) -> RawDataset:
        drawn = draw_per_class(_members(found, kind), train, draw.seed)
        rule = f"{train} of each class drawn for train by seed {draw.seed}, the others test"
        return replace(found, drawn=drawn, split_rule=rule)

    return split


def shares(train: float, kind: Callable[[Entry], str] = class_of) -> Split:
    """That share of each kind for train, the rest for test."""

    def split(found: RawDataset, draw: Draw) -> RawDataset:
        drawn = draw_fractions(_members(found, kind), {"train": train, "test": 1 - train}, draw.seed)
        return replace(
            found, drawn=drawn, split_rule=f"{train:.0%} drawn for train by seed {draw.seed}, the rest test"
        )

    return split


def by_fold(found: RawDataset, draw: Draw) -> RawDataset:
    """The fold that is asked for is test, the others are train. UsageError: there is no such fold."""
    count = max(found.folds.values(), default=-1) + 1
    if draw.fold >= count:
        raise UsageError(f"{found.name} has the folds 0 to {count - 1}; --fold is one of them, not {draw.fold}")
    drawn = {name: "test" if fold == draw.fold else "train" for name, fold in found.folds.items()}
    return replace(found, drawn=drawn, split_rule=f"fold {draw.fold} of {count} is test, the others train")


def _members(found: RawDataset, kind: Callable[[Entry], str]) -> list[Member]:
    numbers = {name: number for number, name in enumerate(sorted({kind(entry) for entry in found.entries}))}
    return [Member(entry.id, numbers[kind(entry)], entry.group) for entry in found.entries]
