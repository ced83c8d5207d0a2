"""Which meshes of a data set its page shows."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from meshshard.data_card.survey import Survey
from meshshard.dataset import Dataset
from meshshard.sample import DIAGNOSTICS

OF_SPLIT, OF_CLASS, CLASSES = 8, 3, 60
"""Meshes of a split, at most; meshes of a class; pictures of classes together."""


@dataclass(frozen=True)
class Example:
    """A mesh by its number in the data set, and what it is shown for."""

    number: int
    caption: str


@dataclass(frozen=True)
class Group:
    """Meshes that are shown together."""

    title: str
    examples: tuple[Example, ...]


def examples(dataset: Dataset, seen: Survey) -> list[Group]:
    """Meshes spread over each split, or over each class of whole meshes; where classes have their largest share; the
    smallest and the largest mesh, where sizes differ; for each diagnostic the mesh with most of it. A hundred at
    most, about."""
    if not len(dataset):
        return []
    groups = _of_classes(dataset, seen) if "meshes" in seen.labelled and dataset.classes else _of_splits(seen)
    if "meshes" not in seen.labelled:
        typical = [Example(int(n), name) for n, name in zip(seen.typical, dataset.classes, strict=True) if n >= 0]
        groups.append(Group("Where each class has its largest share", tuple(typical[:CLASSES])))
    ends = [(int(seen.faces.argmin()), "fewest faces"), (int(seen.faces.argmax()), "most faces")]
    differ = seen.faces.min() < seen.faces.max()
    groups.append(Group("Smallest and largest", tuple(Example(*end) for end in ends if differ)))
    worst = [
        Example(int(seen.diagnostics[:, column].argmax()), f"{name}: {seen.diagnostics[:, column].max():,}")
        for column, name in enumerate(DIAGNOSTICS)
        if seen.affected[:, column].any()
    ]
    groups.append(Group("Most of each diagnostic", tuple(worst)))
    return [group for group in groups if group.examples]


def _of_splits(seen: Survey) -> list[Group]:
    return [
        Group(f"Split {name}" if name else "In no split", _spread(np.flatnonzero(seen.split == place), OF_SPLIT, ""))
        for place, name in enumerate(seen.splits)
    ]


def _of_classes(dataset: Dataset, seen: Survey) -> list[Group]:
    each = max(1, min(OF_CLASS, CLASSES // len(dataset.classes)))
    found: list[Example] = []
    for number, name in enumerate(dataset.classes[:CLASSES]):
        found += _spread(np.flatnonzero(seen.mesh_label == number), each, name)
    left = len(dataset.classes) - CLASSES
    return [Group(f"Classes ({left} more are not shown)" if left > 0 else "Classes", tuple(found))]


def _spread(numbers: Sequence[int] | np.ndarray, count: int, caption: str) -> tuple[Example, ...]:
    """Up to `count` of them, at even distances."""
    places = np.linspace(0, len(numbers) - 1, min(count, len(numbers))).round().astype(int)
    return tuple(Example(int(numbers[place]), caption) for place in places)
