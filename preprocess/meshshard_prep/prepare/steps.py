"""From the mesh of the file to the mesh that is stored, as a recipe says."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Int64

from meshshard.recipe import Recipe
from meshshard_prep.labels import Labels
from meshshard_prep.mesh import RawMesh
from meshshard_prep.prepare.largest_component import largest_component
from meshshard_prep.prepare.orient import orient
from meshshard_prep.prepare.simplify import simplify
from meshshard_prep.prepare.traced import Traced, traced
from meshshard_prep.prepare.transfer import carried
from meshshard_prep.prepare.weld import weld

STEPS: dict[str, Callable[[Traced], tuple[Traced, dict[str, int]]]] = {
    "weld": weld,
    "largest_component": largest_component,
    "orient": orient,
}
"""What each name in a recipe's `steps` does: a mesh to a mesh, and counts under the names of DIAGNOSTICS."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Prepared:
    """The mesh that is stored, with its labels. `mesh.face_source` and `mesh.polygons` are about the file still.
    `vertex_source`: vertex of the file that each vertex is or lies nearest to; None where nothing was done."""

    mesh: RawMesh
    labels: Labels | None
    vertex_source: Int64[np.ndarray, " V"] | None = None
    counts: dict[str, int] = field(default_factory=dict)


def prepare(raw: RawMesh, labels: Labels | None, recipe: Recipe, *, place: str = "") -> Prepared:
    """Take the recipe's steps, in its order, then simplify; carry the labels along. The arrays given do not change.

    Without either, mesh and labels are those of the file. InvalidMesh: the mesh breaks a rule of `clean`, or nothing
    is left of it. UsageError: simplify without pymeshlab. Lost: its process was.
    """
    if not recipe.changes_mesh:
        return Prepared(mesh=raw, labels=labels)
    mesh = traced(raw, place)
    counts: dict[str, int] = {}
    for name in recipe.steps:
        mesh, found = STEPS[name](mesh)
        counts |= found
    if recipe.simplify:
        mesh, found = simplify(mesh, recipe.simplify)
        counts |= found
    if labels is not None:
        labels, found = carried(labels, mesh)
        counts |= found
    stored = RawMesh(
        vertices=mesh.vertices,
        faces=mesh.faces,
        face_source=raw.face_source[mesh.triangle_sources[:, 0]],
        polygons=raw.polygons,
    )
    return Prepared(mesh=stored, labels=labels, vertex_source=mesh.vertex_source, counts=counts)
