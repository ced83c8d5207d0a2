"""What a mesh file has, what is repaired on its working copy, and whether it is stored or why not."""

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from meshshard.errors import InvalidMesh, UsageError
from meshshard.recipe import Recipe
from meshshard.sample import Sample
from meshshard_prep.clean import clean
from meshshard_prep.datasets.folder import labels_beside, read_folder
from meshshard_prep.datasets.layout import Entry, LabelFile
from meshshard_prep.facts import facts_of
from meshshard_prep.features.edges import edges_of
from meshshard_prep.formats import format_of, parse_mesh, read_file
from meshshard_prep.isolation import Limits, isolated
from meshshard_prep.jobs import make_job, printable, read_entry
from meshshard_prep.labels import class_table, labels_of, listed, offered
from meshshard_prep.lost import Lost
from meshshard_prep.mesh import RawMesh
from meshshard_prep.pipeline import compute_sample, counts_of
from meshshard_prep.prepare.steps import prepare
from meshshard_prep.work import warm_up


@dataclass(frozen=True, kw_only=True)
class Diagnosis:
    """One mesh file. `found`: what could be found out, as docs/cli.md lists it, up to where the file broke a rule."""

    source: str
    found: dict[str, Any] = field(default_factory=dict)
    refusal: InvalidMesh | Lost | None

    def table(self) -> dict[str, Any]:
        """As JSON: `code`, `message` and `advice` are empty where the mesh is usable."""
        refusal = self.refusal
        return {
            "source": self.source,
            "usable": refusal is None,
            "code": refusal.code if refusal else "",
            "message": str(refusal or ""),
            "advice": refusal.advice if refusal else "",
            **self.found,
        }


def entries_at(path: Path) -> list[Entry]:
    """The mesh files that a path means, as `features` would take its folder: with the label files beside them.

    UsageError: nothing is there, or no mesh.
    """
    if not path.exists() and not path.is_symlink():
        raise UsageError(f"there is no {path}; name mesh files, or folders of them")
    entries = read_folder(path).entries
    if path.is_file() and (labels := labels_beside(path)):
        _, table = class_table([LabelFile(path=labels)], (), path)
        entries = tuple(replace(entry, labels=LabelFile(path=labels, classes=table)) for entry in entries)
    return [replace(entry, source=str(entry.path)) for entry in entries]


def examine(entry: Entry, recipe: Recipe, limits: Limits) -> Diagnosis:
    """All about one mesh, found out in a process of its own: of a mesh that breaks it, the cause is told. UsageError:
    the recipe suits no mesh."""
    try:
        return isolated(warm_up, recipe).call(diagnose, entry, recipe, limits=limits)
    except Lost as lost:
        return Diagnosis(source=printable(entry.source), refusal=lost)


def diagnose(entry: Entry, recipe: Recipe) -> Diagnosis:
    """All about one mesh, in this process. UsageError: the recipe suits no mesh."""
    outcome = _verdict(entry, recipe)
    found: dict[str, Any] = {}
    with suppress(InvalidMesh):  # the verdict says it
        for part in _findings(entry, recipe):
            found |= part
    if isinstance(outcome, InvalidMesh):
        return Diagnosis(source=printable(entry.source), found=found, refusal=outcome)
    found["counts"] = dict(outcome.diagnostics)
    found["hks"] = {"error_bound": outcome.hks_error_bound, "poles": outcome.hks_poles}
    return Diagnosis(source=printable(entry.source), found=found, refusal=None)


def _verdict(entry: Entry, recipe: Recipe) -> Sample | InvalidMesh:
    """What `features` would make of it."""
    try:
        make_job(entry, recipe)  # refuses names and files that cannot be read
        return compute_sample(entry, *read_entry(entry), recipe)
    except InvalidMesh as error:
        return error


def _findings(entry: Entry, recipe: Recipe) -> Iterator[dict[str, Any]]:
    """One after the other, the cheapest first, until InvalidMesh."""
    data = read_file(entry.path, entry.source)
    yield {"bytes": len(data)}
    yield {"format": format_of(data, entry.source, entry.path.suffix)}
    raw = parse_mesh(data, entry.source, entry.path.suffix)
    yield {"vertices": len(raw.vertices), "polygons": raw.polygons, "triangles": len(raw.faces)}
    yield {"low": raw.vertices.min(axis=0).tolist(), "high": raw.vertices.max(axis=0).tolist()}
    with suppress(InvalidMesh):
        yield _labels(entry, raw)
    if found := offered(data, entry.path.suffix):
        yield {"offered": [{"form": form, "name": name, "domain": domain} for form, name, domain in found]}
    raw = prepare(raw, None, recipe, place=entry.source).mesh
    if recipe.changes_mesh:
        yield {"prepared": {"vertices": len(raw.vertices), "triangles": len(raw.faces)}}
    mesh = clean(raw.vertices, raw.faces, weld=recipe.weld, place=entry.source)
    edges = edges_of(mesh.faces)
    yield {"centre": mesh.centre.tolist(), "radius": mesh.scale, "counts": counts_of(mesh, edges)}
    yield asdict(facts_of(mesh.vertices, mesh.faces, edges))


def _labels(entry: Entry, raw: RawMesh) -> dict[str, Any]:
    file = entry.labels
    if file is None:
        return {}
    name = file.path.name
    lines, domains = listed(file, read_file(file.path, name), raw)
    labels = labels_of(raw, lines, domains, name, file.to)
    names = {number: value for value, number in file.classes.items()}
    values, counts = np.unique(lines, return_counts=True)
    shares = {str(names.get(value, -1)): count for value, count in zip(values.tolist(), counts.tolist(), strict=True)}
    found = {"file": name, "domain": labels.domain, "lines": shares}
    return {"labels": found | ({"rule": labels.rule} if labels.rule else {})}
