"""Several sets of labelled meshes as one data set."""

from collections.abc import Sequence
from dataclasses import replace

from meshshard_prep.datasets.layout import Entry, RawDataset


def joined(name: str, parts: Sequence[tuple[str, str, RawDataset]]) -> RawDataset:
    """`parts`: what a set's ids begin with, its folder, and the set, whose meshes all have label files. Classes are
    those of the first set, then those of the second, and so on."""
    classes: list[str] = []
    entries: list[Entry] = []
    for prefix, folder, part in parts:
        for entry in part.entries:
            assert entry.labels is not None
            table = {value: len(classes) + number for value, number in entry.labels.classes.items()}
            labels = replace(entry.labels, classes=table)
            source = f"{folder}/{entry.source}"
            entries.append(replace(entry, id=f"{prefix}/{entry.id}", source=source, labels=labels))
        classes += part.classes
    notes = tuple(note for _, _, part in parts for note in part.notes)
    return RawDataset(name=name, task="segmentation", classes=tuple(classes), entries=tuple(entries), notes=notes)
