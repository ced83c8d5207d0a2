"""Which vertex of a mesh lies at each vertex of a template: read, checked, never guessed."""

import numpy as np
from jaxtyping import Int32

from meshshard.errors import InvalidMesh, UsageError
from meshshard.recipe import Recipe
from meshshard_prep.datasets.layout import Entry, RawDataset

NONE = -1
"""In a file and in a shard: the mesh has no vertex there."""


def correspondence_of(entry: Entry, data: bytes | None, vertices: int) -> Int32[np.ndarray, " M"] | None:
    """The vertex (0-based) at each of the template's M vertices, -1 for none; None where the entry names no template.

    `data`: the bytes of the entry's file, None where the mesh has the template's own vertices. `vertices`: of the
    mesh. InvalidMesh: a line that is no integer, a vertex that the mesh does not have, another length than M.
    """
    if entry.correspondence is None:
        return None
    place = entry.correspondence.name
    found = np.arange(vertices) if data is None else _read(data, vertices, place)
    if len(found) != entry.template:
        raise InvalidMesh(
            "correspondence-count",
            f"the template has {entry.template} vertices, and a mesh one line, or one vertex, for each",
            f"there are {len(found)}",
            place=place,
            advice="take the files of one template; look whether this one is whole",
        )
    return found.astype(np.int32)


def _read(data: bytes, vertices: int, place: str) -> np.ndarray:
    """The lines of a file, counted from 0."""
    lines = data.rstrip().splitlines()
    found = np.empty(len(lines), dtype=np.int64)
    for number, line in enumerate(lines):
        word = line.strip()
        value = int(word) if word.removeprefix(b"-").isdigit() and len(word) < 10 else 0
        if value != NONE and not 1 <= value <= vertices:
            raise InvalidMesh(
                "bad-correspondence",
                f"a line is a vertex of the mesh, 1 to {vertices}, or {NONE} for none",
                f"this one is {word[:40].decode(errors='replace')!r}",
                place=f"{place}:{number + 1}",
                advice="pair the mesh with the file made for it",
            )
        found[number] = value if value == NONE else value - 1
    return found


def check_vertices_stay(dataset: RawDataset, recipe: Recipe) -> None:
    """UsageError: the recipe changes which vertices there are, and the data set names vertices of its files."""
    change = [step for step in recipe.steps if step != "orient"] + ["simplify"] * (recipe.simplify > 0)
    if change and any(entry.correspondence is not None for entry in dataset.entries):
        raise UsageError(
            f"{dataset.name} says which vertex of each mesh file is which of a template, and {', '.join(change)} in "
            f"recipe {recipe.name} would take vertices away; leave that out"
        )
