"""Pictures of meshes coloured by class, and of a run's curves. No display is needed."""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from jaxtyping import Float, Int
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from meshshard.palette import class_colour, colours_of
from meshshard.render import render

DPI = 110


@dataclass(frozen=True, eq=False, kw_only=True)
class Tile:
    """One mesh of a gallery; `vertices` are normalised, y is up."""

    title: str
    vertices: Float[np.ndarray, "V 3"]
    faces: Int[np.ndarray, "F 3"]
    labels: Int[np.ndarray, " F"]


def gallery(
    path: Path,
    tiles: Sequence[Tile],
    classes: Sequence[str],
    *,
    columns: int,
    title: str,
    size: float = 2.4,
    colours: Sequence[str] = (),
) -> None:
    """A PNG of meshes in rows, each `size` inches, with a legend of the classes that occur. `colours`: hexadecimal,
    of a data set that has its own."""
    rows = -(-len(tiles) // columns)
    figure = Figure(figsize=(size * columns, size * rows + 0.9), dpi=DPI, layout="constrained")
    figure.suptitle(title)
    for number, tile in enumerate(tiles, start=1):
        picture = render(tile.vertices, tile.faces, colours_of(tile.labels, colours), size=round(size * DPI))
        axes = figure.add_subplot(rows, columns, number)
        axes.imshow(picture)
        axes.set_axis_off()
        axes.set_title(tile.title, fontsize="small")
    found = sorted({int(label) for tile in tiles for label in np.unique(tile.labels)})
    figure.legend(
        handles=[Patch(color=class_colour(c, colours), label="unlabelled" if c < 0 else classes[c]) for c in found],
        loc="outside lower center",
        ncols=min(len(found), max(4, 2 * columns)),
        fontsize="small",
        frameon=False,
    )
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph .* missing")  # a title may be in any script
        figure.savefig(path)


def curves(path: Path, history: Sequence[dict[str, Any]], *, title: str) -> None:
    """A PNG of training loss and validation accuracy over epochs."""
    with mpl.rc_context({"axes.grid": True, "grid.alpha": 0.3}):
        figure = Figure(figsize=(8, 3), dpi=DPI, layout="constrained")
        figure.suptitle(title)
        left, right = figure.subplots(1, 2)
        epochs = [row["epoch"] for row in history]
        left.plot(epochs, [row["loss"] for row in history], color=class_colour(0))
        left.set(xlabel="epoch", ylabel="training loss")
        right.plot(epochs, [100 * row["val_accuracy"] for row in history], color=class_colour(3))
        right.set(xlabel="epoch", ylabel="validation accuracy, raw, %")
        figure.savefig(path)
