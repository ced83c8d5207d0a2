"""Which meshes are listed, and in which order: from the index and the scores alone."""

import math
from collections.abc import Mapping

from meshshard.dataset import Dataset

STORED, LARGEST, WORST = "as stored", "most vertices first", "worst first"


class Listing:
    """The meshes of a data set by number. Nothing is read but its index."""

    def __init__(self, dataset: Dataset) -> None:
        index = dataset.index
        self.names = index.ids
        self.about = [split or "no split" for split in index.splits]
        self.sizes = dataset.vertex_counts
        self._text = [f"{name} {about}".casefold() for name, about in zip(self.names, self.about, strict=True)]

    def find(self, text: str, order: str, scores: Mapping[int, float]) -> list[int]:
        """Meshes with every word of `text` in their id or split. WORST: those with the lowest score first, then
        those without one, in the order they are stored in."""
        words = text.casefold().split()
        found = [number for number, name in enumerate(self._text) if all(word in name for word in words)]
        if order == LARGEST:
            return sorted(found, key=lambda number: -self.sizes[number])
        if order == WORST:
            return sorted(found, key=lambda number: scores.get(number, math.inf))
        return found
