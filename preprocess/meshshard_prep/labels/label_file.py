"""Where the labels of a mesh are."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

DOMAINS = ("face", "edge", "vertex")
"""What a label file may count."""


@dataclass(frozen=True, kw_only=True)
class LabelFile:
    """Where the labels of a mesh are, and what they mean.

    `path`: the file, which may be the mesh file itself. `form`: how labels are written there, a key of
    `meshshard_prep.labels.FORMS`; `name`: of the property or column, for forms that have some. `classes`: what is
    written -> class index, -1 for unlabelled. `domains`: what the file may count, of "face", "edge", "vertex".
    `to`: "face" or "vertex", what the labels are converted to; empty: edges' become faces', others stay.
    """

    path: Path
    form: str = "lines"
    name: str = ""
    classes: Mapping[int | str, int] = field(default_factory=dict)
    domains: tuple[str, ...] = DOMAINS
    to: str = ""
