"""Deformed copies of training meshes, as entries of their own."""

from dataclasses import replace

from meshshard.copies import copy_id
from meshshard.errors import UsageError
from meshshard_prep.datasets.layout import RawDataset


def with_copies(dataset: RawDataset, copies: int) -> RawDataset:
    """The data set with so many deformed copies of each mesh of train. UsageError: it has no such split."""
    if copies == 0:
        return dataset
    splits = dataset.splits
    originals = [entry for entry in dataset.entries if splits[entry.id] == "train"]
    if not originals:
        raise UsageError(f"--deformed is about meshes of train, and {dataset.name} has no such split; leave it out")
    added = [
        replace(entry, id=copy_id(entry.id, number), split="train", deformed=number)
        for entry in originals
        for number in range(1, copies + 1)
    ]
    told = f"{copies} deformed {'copy' if copies == 1 else 'copies'} of each training mesh"
    return replace(
        dataset,
        entries=(*dataset.entries, *added),
        drawn=None if dataset.drawn is None else {**dataset.drawn, **{entry.id: "train" for entry in added}},
        split_rule=f"{dataset.split_rule}; {told}",
    )
