"""Deformed copies of training meshes, as their ids tell: a mesh of another shape with the same labels."""

import re
from collections.abc import Iterable

_COPY = re.compile(r"(.+)~deformed([1-9][0-9]*)")


def copy_id(id: str, number: int) -> str:
    """The id of a mesh's copy; copies are numbered from 1."""
    return f"{id}~deformed{number}"


def original_id(id: str) -> str:
    """The id of the mesh that this one is a copy of; its own, if it is none."""
    match = _COPY.fullmatch(id)
    return match[1] if match else id


def most_copies(ids: Iterable[str]) -> int:
    """The highest number of a copy; 0 if there are none."""
    return max((int(match[2]) for id in ids if (match := _COPY.fullmatch(id))), default=0)
