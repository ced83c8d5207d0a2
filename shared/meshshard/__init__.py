"""meshshard: feature shards of triangle meshes. This package is the format: it reads, checks and writes shards.

>>> from meshshard import open_dataset
>>> dataset = open_dataset("data/features/minicoseg/paper")   # doctest: +SKIP
>>> dataset[0].hks.shape                                       # doctest: +SKIP
(512, 16)
"""

from meshshard.dataset import Dataset, open_dataset
from meshshard.errors import InvalidMesh, InvalidShard, MeshshardError, UsageError
from meshshard.recipe import RECIPES, Recipe
from meshshard.sample import Sample

__version__ = "0.1.0"

__all__ = [
    "RECIPES",
    "Dataset",
    "InvalidMesh",
    "InvalidShard",
    "MeshshardError",
    "Recipe",
    "Sample",
    "UsageError",
    "__version__",
    "open_dataset",
]
