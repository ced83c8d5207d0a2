"""The card as one HTML file with pictures, that needs no network."""

from base64 import b64encode
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from jaxtyping import Int64, UInt8

from meshshard.data_card.examples import Example, examples
from meshshard.data_card.survey import Survey
from meshshard.data_card.tables import shown, tables
from meshshard.dataset import Dataset
from meshshard.palette import VIRIDIS, class_colour, colours_between, colours_of
from meshshard.render import png_bytes, render
from meshshard.sample import Sample

BARS = 24
FOLDED = np.pi / 2
"""Radians: mean turning angle from which on vertices of unlabelled meshes are yellow."""


def card_page(dataset: Dataset, seen: Survey, card: dict[str, Any]) -> str:
    """The page of a data set: its tables, how sizes are distributed, and pictures of some meshes. Every name in it is
    escaped."""
    return fill("card.html", (), card_parts(dataset, seen, card))


def fill(template: str, packages: Sequence[str], values: Mapping[str, Any]) -> str:
    """A page from a template of this package, or of others that extend or include what is here; all values are
    escaped, and none may be missing."""
    from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined

    loader = ChoiceLoader([PackageLoader(package, "") for package in (*packages, __package__)])
    environment = Environment(
        loader=loader, autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    return environment.get_template(template).render(values)


def card_parts(dataset: Dataset, seen: Survey, card: dict[str, Any], *, level: int = 2) -> dict[str, Any]:
    """What `data.html` shows of a data set. `level`: of its headings."""
    return {
        "level": level,
        "name": shown(card["dataset"]),
        "tables": tables(card),
        "histograms": [histogram(seen.faces, "faces"), histogram(seen.vertices, "vertices")] if len(dataset) else [],
        "balance": _balance(card),
        "legend": _legend(card),
        "gradient": ", ".join(VIRIDIS) if not card["classes"] else "",
        "groups": [
            {"title": group.title, "figures": [_figure(dataset, example) for example in group.examples]}
            for group in examples(dataset, seen)
        ],
    }


def colours_for(sample: Sample, chosen: tuple[str, ...]) -> UInt8[np.ndarray, "F 3"] | UInt8[np.ndarray, "F 3 3"]:
    """What `render` colours a mesh with: the classes of its faces, vertices or whole, else its dihedral angles."""
    if sample.face_labels is not None:
        return colours_of(sample.face_labels, chosen)
    if sample.vertex_labels is not None:
        return colours_of(sample.vertex_labels, chosen)[sample.faces]
    if sample.mesh_label >= 0:
        return colours_of(np.full(len(sample.faces), sample.mesh_label), chosen)
    return colours_between(sample.dihedral.astype(np.float64), 0.0, FOLDED)[sample.faces]


def histogram(counts: Int64[np.ndarray, " n"], what: str) -> dict[str, Any]:
    """How many meshes have how many faces, say: bars in a box of 100 by 100 with the origin on top, none where all
    have the same. Bars are equally wide, on a scale of ratios where counts differ more than tenfold."""
    least, most = int(counts.min()), int(counts.max())
    wide = most > 10 * least
    places = (np.geomspace if wide else np.linspace)(least, most + 1, BARS + 1)
    edges = np.unique(np.rint(places).astype(np.int64))
    meshes, _ = np.histogram(counts, edges)
    heights, width = 100 * meshes / meshes.max(), 100 / len(meshes)
    return {
        "title": f"{what.capitalize()} of a mesh{', logarithmic scale' if wide else ''}",
        "ends": (f"{least:,}", f"{most:,}"),
        "tallest": f"{meshes.max():,}",
        "summary": f"{len(counts):,} meshes of {least:,} to {most:,} {what}, median {np.median(counts):,.10g}",
        "bars": [
            {
                "x": f"{place * width:.3f}",
                "y": f"{100 - heights[place]:.2f}",
                "width": f"{width:.3f}",
                "height": f"{heights[place]:.2f}",
                "text": f"{start:,} to {end - 1:,} {what}: {number:,} meshes",
            }
            for place, (start, end, number) in enumerate(zip(edges[:-1], edges[1:], meshes, strict=True))
            if number and most > least
        ],
    }


def _balance(card: dict[str, Any]) -> list[dict[str, Any]]:
    """A bar for each split, parted by the share of each class."""
    return [
        {
            "split": shown(name or "(no split)"),
            "parts": [
                {
                    "colour": colour,
                    "width": f"{100 * row['count_share']:.3f}",
                    "text": shown(f"{row['name']}: {100 * row['count_share']:.1f} %"),
                }
                for row, colour in zip(part["classes"], card["colours"], strict=True)
                if row["count"]
            ],
        }
        for name, part in card["splits"].items()
        if any(row["count"] for row in part["classes"])
    ]


def _legend(card: dict[str, Any]) -> list[dict[str, str]]:
    found = [
        {"colour": colour, "name": shown(name)} for name, colour in zip(card["classes"], card["colours"], strict=True)
    ]
    if card["all"]["unlabelled"]:
        found.append({"colour": class_colour(-1), "name": "unlabelled"})
    return found


def _figure(dataset: Dataset, example: Example) -> dict[str, str]:
    sample = dataset[example.number]
    split = dataset.index.splits[example.number] or "no split"
    faces = f"{len(sample.faces):,} face{'s' if len(sample.faces) > 1 else ''}"
    return {
        "image": picture_of(sample, colours_for(sample, dataset.index.colours)),
        "alt": shown(f"mesh {sample.id}, {faces}, {split}"),
        "id": shown(sample.id),
        "caption": shown(example.caption),
        "faces": faces,
    }


def picture_of(sample: Sample, colours: UInt8[np.ndarray, "F 3"] | UInt8[np.ndarray, "F 3 3"]) -> str:
    """A mesh as a small PNG file in base64."""
    return b64encode(png_bytes(render(sample.vertices, sample.faces, colours), small=True)).decode()
