"""Shards in the formats of other tools, a file for each mesh.

A format is an entry point of the group `meshshard.exporters`: a function that takes the data set, and `colour` where
the format has colours, and gives an `Exporter`, or raises UsageError for what the data set lacks.
"""

from collections.abc import Callable
from dataclasses import dataclass

from meshshard.sample import Sample


@dataclass(frozen=True)
class Exporter:
    """How the meshes of a data set are written: `suffix` of the files, and the bytes of one of them. `encode` raises
    InvalidMesh for a mesh that the format cannot hold. `note`: a sentence for whoever uses the files, or empty."""

    suffix: str
    encode: Callable[[Sample], bytes]
    note: str = ""
