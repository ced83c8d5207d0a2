"""A folder of shards as a data set of PyTorch Geometric. Needs the extra `pyg`.

>>> from meshshard_train.pyg import ShardGraphs
>>> graphs = ShardGraphs("data/features/minicoseg/paper", split="train")   # doctest: +SKIP
>>> graphs[0]                                                             # doctest: +SKIP
Data(x=[512, 20], face=[3, 1020], y=[1020], pos=[512, 3], id='chair_000')
"""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from torch_geometric.data import Data, Dataset

from meshshard import open_dataset
from meshshard.export.select import select
from meshshard_train.graphs import INPUTS, graph_of, input_columns


class ShardGraphs(Dataset):  # type: ignore[misc]  # PyG ships no types
    """Meshes read from the shards when they are asked for; nothing is copied into files of PyG's own.

    Each is a `Data` with pos, face, x, y (see `graphs.graph_of`) and its `id`. `split`: only its meshes; all if None.
    `inputs`: the fields of vertices that make `x`; `columns` names its columns. `transform`: as everywhere in PyG.
    UsageError: no such split, or an input that the data set does not hold.
    """

    def __init__(
        self,
        folder: str | Path,
        split: str | None = None,
        inputs: Sequence[str] = INPUTS,
        transform: Callable[[Data], Any] | None = None,
    ) -> None:
        self.shards, self.inputs = open_dataset(folder), tuple(inputs)
        self.numbers = select(self.shards, split)
        self.columns = input_columns(self.shards, self.inputs)
        super().__init__(transform=transform)

    def len(self) -> int:
        """Meshes of the split."""
        return len(self.numbers)

    def get(self, idx: int) -> Data:
        """One mesh, before `transform`."""
        sample = self.shards[self.numbers[idx]]
        return Data(**graph_of(sample, self.shards.task, self.inputs), id=sample.id)

    @property
    def num_classes(self) -> int:
        """Classes of the data set, whether or not they occur in the split."""
        return len(self.shards.classes)
