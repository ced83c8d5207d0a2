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
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from meshshard.palette import class_colour, colours_of

LIGHT = np.array([0.4, 0.8, 0.45]) / np.linalg.norm([0.4, 0.8, 0.45])


@dataclass(frozen=True, eq=False, kw_only=True)
class Tile:
    """One mesh of a gallery; `vertices` are normalised, y is up."""

    title: str
    vertices: Float[np.ndarray, "V 3"]
    faces: Int[np.ndarray, "F 3"]
    labels: Int[np.ndarray, " F"]


def gallery(
    path: Path, tiles: Sequence[Tile], classes: Sequence[str], *, columns: int, title: str, size: float = 2.4
) -> None:
    """A PNG of meshes in rows, each `size` inches, with a legend of the classes that occur."""
    rows = -(-len(tiles) // columns)
    figure = Figure(figsize=(size * columns, size * rows + 0.9), dpi=110, layout="constrained")
    figure.suptitle(title)
    for number, tile in enumerate(tiles, start=1):
        axes: Any = figure.add_subplot(rows, columns, number, projection="3d")
        _draw(axes, tile)
    found = sorted({int(label) for tile in tiles for label in np.unique(tile.labels)})
    figure.legend(
        handles=[Patch(color=class_colour(c), label="unlabelled" if c < 0 else classes[c]) for c in found],
        loc="outside lower center",
        ncols=min(len(found), max(4, 2 * columns)),
        fontsize="small",
        frameon=False,
    )
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph .* missing")  # a title may be in any script
        figure.savefig(path)


def _draw(axes: Any, tile: Tile) -> None:
    points = tile.vertices[:, [2, 0, 1]]  # matplotlib's third axis is up
    triangles = points[tile.faces]
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    shade = 0.45 + 0.55 * np.abs(normals / np.where(length > 0, length, 1) @ LIGHT)
    colours = colours_of(tile.labels) / 255 * shade[:, None]
    axes.add_collection3d(Poly3DCollection(triangles, facecolors=colours, edgecolors="none", antialiased=False))
    reach = float(np.abs(points).max())
    axes.set(xlim=(-reach, reach), ylim=(-reach, reach), zlim=(-reach, reach))
    axes.set_box_aspect((1, 1, 1), zoom=1.35)
    axes.view_init(elev=18, azim=35)
    axes.set_axis_off()
    axes.set_title(tile.title, fontsize="small", y=1.0)


def curves(path: Path, history: Sequence[dict[str, Any]], *, title: str) -> None:
    """A PNG of training loss and validation accuracy over epochs."""
    with mpl.rc_context({"axes.grid": True, "grid.alpha": 0.3}):
        figure = Figure(figsize=(8, 3), dpi=110, layout="constrained")
        figure.suptitle(title)
        left, right = figure.subplots(1, 2)
        epochs = [row["epoch"] for row in history]
        left.plot(epochs, [row["loss"] for row in history], color=class_colour(0))
        left.set(xlabel="epoch", ylabel="training loss")
        right.plot(epochs, [100 * row["val_accuracy"] for row in history], color=class_colour(3))
        right.set(xlabel="epoch", ylabel="validation accuracy, raw, %")
        figure.savefig(path)
