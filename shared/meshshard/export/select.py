"""Which meshes of a data set are meant."""

from collections.abc import Sequence
from fnmatch import fnmatchcase

from meshshard.dataset import Dataset
from meshshard.errors import UsageError


def select(dataset: Dataset, split: str | None, patterns: Sequence[str] = ()) -> list[int]:
    """Numbers of the samples in a split, or in all, whose id matches any of the patterns, or any id.

    UsageError: no such split, or a pattern that no id of it matches.
    """
    if split is not None and split not in dataset.splits:
        raise UsageError(f"{dataset.folder} has no split {split!r}; there are {', '.join(map(repr, dataset.splits))}")
    numbers = range(len(dataset)) if split is None else dataset.splits[split]
    matching = {p: {n for n in numbers if fnmatchcase(dataset.ids[n], p)} for p in patterns}
    for pattern, found in matching.items():
        if not found:
            few = ", ".join(dataset.ids[number] for number in numbers[:3])
            raise UsageError(f"--id {pattern}: no mesh has such an id; the first of {len(numbers)} are {few}")
    return sorted(set().union(*matching.values())) if patterns else list(numbers)
