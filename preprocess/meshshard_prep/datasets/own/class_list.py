"""A list with the class of each mesh: a text of lines, or a JSON object."""

import json
import re
from dataclasses import dataclass
from pathlib import Path

from meshshard.errors import UsageError
from meshshard_prep.datasets.own.names import rows_of


@dataclass(frozen=True, kw_only=True)
class Row:
    """`place`: file and line, or file and key. `text`: the line or key itself. `label`: empty where there is none."""

    place: str
    text: str
    mesh: str
    label: str


def read_class_list(path: Path, place: str) -> list[Row]:
    """The rows of a list, in its order; a file that ends in .json is an object: mesh -> class, a text or an integer.

    UsageError: it cannot be read, or is no such object; `place` says who asks for it.
    """
    if path.suffix.lower() == ".json":
        return _of_json(path, place)
    found = []
    for number, line in rows_of(path, place):
        mesh, label = _parts(line)
        found.append(Row(place=f"{path.name}:{number}", text=line, mesh=mesh, label=label))
    return found


def _parts(line: str) -> tuple[str, str]:
    """Mesh and class: what stands on either side of the last comma, semicolon or tab, or, without one, blank. Both
    without quotes; no class where there is no such sign."""
    match = re.fullmatch(r"(.*)[,;\t](.*)", line) or re.fullmatch(r"(.*\S)\s+(\S+)", line)
    mesh, label = (match[1], match[2]) if match else (line, "")
    return mesh.strip().strip('"'), label.strip().strip('"')


def _of_json(path: Path, place: str) -> list[Row]:
    try:
        content = json.loads(path.read_text(encoding="utf-8-sig"))
    except (OSError, ValueError, RecursionError) as error:
        raise UsageError(f"{place}: the list {path} cannot be read: {error}") from error
    rule = f"{place}: the list {path} is an object that has a text or an integer, the class, for each mesh"
    if not isinstance(content, dict):
        raise UsageError(f"{rule}, and no {type(content).__name__}")
    for mesh, label in content.items():
        if type(label) not in (str, int):
            raise UsageError(f"{rule}; {mesh[:60]!r} has {json.dumps(label)[:60]}")
    return [
        Row(place=f"{path.name}, key {mesh!r}", text=mesh, mesh=mesh, label=str(label))
        for mesh, label in content.items()
    ]
