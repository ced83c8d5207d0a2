"""meshshard: feature shards of triangle meshes. This package is the format: it reads, checks and writes shards.

>>> from meshshard import open_dataset
>>> dataset = open_dataset("data/features/minicoseg/paper")   # doctest: +SKIP
>>> dataset[0].hks.shape                                       # doctest: +SKIP
(512, 16)
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from meshshard.errors import InvalidMesh, InvalidShard, MeshshardError, UsageError

if TYPE_CHECKING:
    from meshshard.dataset import Dataset, open_dataset
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

LATER = {"RECIPES": "recipe", "Recipe": "recipe", "Sample": "sample", "Dataset": "dataset", "open_dataset": "dataset"}
"""Name -> its module, imported when the name is asked for: numpy takes a third of the time that `--help` may take."""


def __getattr__(name: str) -> Any:
    if name not in LATER:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{LATER[name]}"), name)
