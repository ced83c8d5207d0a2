"""The card: a data set in numbers, ready for JSON. docs/cli.md names its keys."""

import json
from collections import Counter
from typing import Any

import numpy as np
from jaxtyping import Bool, Int64

from meshshard.data_card.survey import Survey
from meshshard.dataset import Dataset
from meshshard.index import Rejection
from meshshard.palette import class_colour
from meshshard.recipe import Recipe
from meshshard.sample import DIAGNOSTICS


def data_card(dataset: Dataset, seen: Survey) -> dict[str, Any]:
    """Everything that `meshshard info` tells."""
    index = dataset.index
    return {
        "folder": str(dataset.folder),
        "dataset": dataset.name,
        "task": dataset.task,
        "meshes": len(dataset),
        "licence": index.licence,
        "citation": index.citation,
        "notes": list(index.notes),
        "classes": list(dataset.classes),
        "colours": [class_colour(number, index.colours) for number in range(len(dataset.classes))],
        "labelled": dict(seen.labelled) if dataset.classes else {},
        "label_domains": _named(seen.label_domains),
        "label_rules": _named(seen.label_rules),
        "splits": {name: _part(dataset, seen, [place]) for place, name in enumerate(seen.splits)},
        "all": _part(dataset, seen, list(range(len(seen.splits)))),
        "split_rule": index.split_rule,
        "split_seed": index.split_seed,
        "val_fraction": index.val_fraction,
        "train_fraction": index.train_fraction,
        "refused": _rejected(index.refused),
        "failed": _rejected(index.failed),
        "recipe": json.loads(index.recipe.to_json()),
        "recipe_words": recipe_words(index.recipe),
        "algorithm_version": index.algorithm_version,
        "shards": len(index.shards),
        "bytes": sum(entry.bytes for entry in index.shards),
        "content_sha256": index.content_sha256,
        "splits_sha256": index.splits_sha256,
    }


def _part(dataset: Dataset, seen: Survey, places: list[int]) -> dict[str, Any]:
    """One split, or several together."""
    members = np.isin(seen.split, places)
    bounds = seen.hks_error_bound[members]
    classes = _classes(dataset, seen, places)
    return {
        "meshes": int(members.sum()),
        "vertices": _sizes(seen.vertices[members]),
        "faces": _sizes(seen.faces[members]),
        "classes": classes,
        "missing": [row["name"] for row in classes if not row["count"]],
        "unlabelled": int(seen.unlabelled[places].sum()) if dataset.classes else 0,
        "diagnostics": _diagnostics(seen, members),
        "hks_error_bound": {
            "median": float(np.median(bounds)) if len(bounds) else None,
            "largest": float(bounds.max()) if len(bounds) else None,
        },
    }


def _sizes(counts: Int64[np.ndarray, " n"]) -> dict[str, Any]:
    if not len(counts):
        return {"sum": 0, "least": None, "median": None, "most": None}
    return {
        "sum": int(counts.sum()),
        "least": int(counts.min()),
        "median": float(np.median(counts)),
        "most": int(counts.max()),
    }


def _classes(dataset: Dataset, seen: Survey, places: list[int]) -> list[dict[str, Any]]:
    counts, areas = seen.class_counts[places].sum(axis=0), seen.class_areas[places].sum(axis=0)
    meshes = seen.class_meshes[places].sum(axis=0)
    return [
        {
            "name": name,
            "meshes": int(meshes[number]),
            "count": int(counts[number]),
            "count_share": float(counts[number] / counts.sum()) if counts.any() else None,
            "area_share": float(areas[number] / areas.sum()) if areas.any() else None,
        }
        for number, name in enumerate(dataset.classes)
    ]


def _diagnostics(seen: Survey, members: Bool[np.ndarray, " N"]) -> dict[str, dict[str, int]]:
    affected = seen.affected[members]
    sums, meshes = (seen.diagnostics[members] * affected).sum(axis=0), affected.sum(axis=0)
    return {
        name: {"sum": int(sums[column]), "meshes": int(meshes[column])} for column, name in enumerate(DIAGNOSTICS)
    }


def _named(counts: Counter[str]) -> dict[str, int]:
    return {name: count for name, count in sorted(counts.items()) if name}


def _rejected(entries: tuple[Rejection, ...]) -> dict[str, Any]:
    return {"meshes": len(entries), "codes": dict(sorted(Counter(entry.code for entry in entries).items()))}


def recipe_words(recipe: Recipe) -> str:
    """What a recipe does, as sentences."""
    times = recipe.times
    words = [
        f"{recipe.laplacian} Laplacian"
        + (f" plus {recipe.regularisation:g} times the identity" if recipe.regularisation else "")
        + (", same points merged" if recipe.weld else ""),
        f"heat kernel signature at {len(times)} times from {times[0]:g} to {times[-1]:g} squared radii, "
        f"relative error at most {recipe.hks_tolerance:g}",
        f"pieces {'joined by weak links' if recipe.components == 'bridged' else 'kept separate'}",
    ]
    words += [f"mesh changed by: {', '.join(recipe.steps)}"] if recipe.steps else []
    words += [f"simplified to {recipe.simplify} faces"] if recipe.simplify else []
    words += ["mesh stored as in its file"] if not (recipe.steps or recipe.simplify) else []
    words += [f"{recipe.spectrum} eigenpairs stored"] if recipe.spectrum else []
    words += ["geodesic distances and discs"] if recipe.geodesic else []
    words += ["shape diameters"] if recipe.shape_diameter else []
    words += ["signed dihedral angles"] if recipe.signed_dihedral else []
    words += ["the published code's dihedral channels"] if recipe.official_dihedral else []
    return "; ".join(words)
