"""What prediction writes for a mesh: PLY, picture, a line for each face or vertex, and JSON."""

from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from meshshard import Sample
from meshshard.export.ply import of_classes, ply_bytes
from meshshard.files import publish
from meshshard.label_lines import as_lines, line_confidence, line_labels, line_note
from meshshard.plain import to_json
from meshshard.recipe import Recipe
from meshshard_train.pictures import Tile, gallery
from meshshard_train.tasks import of_corners

ELEMENTS = {"segmentation": "face", "vertex_segmentation": "vertex"}
"""Task -> what is labelled."""

INCHES = 4.0
"""Of the sides of a picture."""


@dataclass(frozen=True, kw_only=True)
class Outputs:
    """What the outputs of a network mean. `recipe`: of its features; `rounds`: of voting that labels went through."""

    task: str
    classes: tuple[str, ...]
    colours: tuple[str, ...]
    recipe: Recipe
    rounds: int
    pictures: bool


def write_mesh(
    outputs: Outputs,
    sample: Sample,
    labels: Int[np.ndarray, " n"],
    probabilities: Float[np.ndarray, "n K"],
    source: Path,
    place: Path,
) -> dict[str, Any]:
    """Write the files of a mesh, `place` with an ending each, and return what is in its .json.

    Segmentation: .ply coloured by class, with the properties `label` and `confidence`; .seg with a class index a
    line, by `line_labels` or of each stored vertex; .confidence with the probability of each; .png.
    `labels`: of stored faces, of stored vertices (-1 without features), or of the mesh; `source`: the mesh file.
    """
    place.parent.mkdir(parents=True, exist_ok=True)
    of_parts = outputs.task in ELEMENTS
    files, facts = (_of_parts if of_parts else _of_mesh)(outputs, sample, labels, probabilities)
    drawn = of_parts and outputs.pictures
    names = [f"{place}{ending}" for ending in (*files, *[".png"] * drawn, ".json")]
    if drawn:
        _draw(outputs, sample, labels, place)
    found = {"source": str(source), "files": names} | facts
    files[".json"] = to_json(found).encode() + b"\n"
    for ending, content in files.items():
        publish(Path(f"{place}{ending}"), content, durable=False)
    return found


Files = tuple[dict[str, bytes], dict[str, Any]]
"""Endings and contents of files, and what else is to be told of a mesh."""


def _of_mesh(outputs: Outputs, _: Sample, labels: np.ndarray, probabilities: np.ndarray) -> Files:
    table = dict(zip(outputs.classes, probabilities[0].tolist(), strict=True))
    chosen = outputs.classes[labels[0]]
    return {}, {"class": chosen, "probability": table[chosen], "probabilities": table}


def _of_parts(outputs: Outputs, sample: Sample, labels: np.ndarray, probabilities: np.ndarray) -> Files:
    element = ELEMENTS[outputs.task]
    chosen = np.where(labels < 0, 0, probabilities[np.arange(len(labels)), labels]).astype(np.float32)
    properties = of_classes(labels, outputs.colours) | {"confidence": chosen}
    lines, confidence = labels, chosen.astype(np.float64)
    if element == "face":
        lines = line_labels(sample, labels, outputs.recipe)
        confidence = line_confidence(sample, lines, probabilities, outputs.recipe)
    counts = Counter(lines.tolist())
    note = line_note(outputs.recipe, element)
    facts = {
        "labelled": element,
        "counts": {name: counts[number] for number, name in enumerate(outputs.classes)},
        "unlabelled": counts[-1],
        "confidence": float(confidence[lines >= 0].mean()),
        "voting_rounds": outputs.rounds,
    } | ({"note": note} if note else {})
    files = {
        ".ply": ply_bytes(sample, face=properties) if element == "face" else ply_bytes(sample, vertex=properties),
        ".seg": as_lines(lines),
        ".confidence": "".join(f"{value:.4f}\n" for value in confidence.tolist()).encode(),
    }
    return files, facts


def _draw(outputs: Outputs, sample: Sample, labels: np.ndarray, place: Path) -> None:
    corners = of_corners(labels, sample, outputs.task)
    tile = Tile(title="", vertices=sample.vertices, faces=sample.faces, labels=corners)
    path, colours = Path(f"{place}.png"), outputs.colours
    gallery(path, [tile], outputs.classes, columns=1, title=place.name, size=INCHES, colours=colours)
