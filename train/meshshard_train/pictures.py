"""Pictures of meshes coloured by class, of a run's curves, and of who is taken for whom. No display is needed."""

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from jaxtyping import Float, Int, UInt8
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from meshshard.palette import class_colour, colours_between, colours_of
from meshshard.render import render
from meshshard_train.metrics import judged

DPI = 110


@dataclass(frozen=True, eq=False, kw_only=True)
class Tile:
    """One mesh of a gallery; `vertices` are normalised, y is up. `labels`: of faces, or of their corners where
    vertices are labelled; colours are blended between them."""

    title: str
    vertices: Float[np.ndarray, "V 3"]
    faces: Int[np.ndarray, "F 3"]
    labels: Int[np.ndarray, " F"] | Int[np.ndarray, "F 3"]


@dataclass(frozen=True, eq=False, kw_only=True)
class Panel:
    """One picture of a sheet; `colours` as `render` takes them."""

    title: str
    vertices: Float[np.ndarray, "V 3"]
    faces: Int[np.ndarray, "F 3"]
    colours: UInt8[np.ndarray, "F 3"] | UInt8[np.ndarray, "F 3 3"]


@dataclass(frozen=True, kw_only=True)
class Scale:
    """What the colours of some panels, by their numbers, mean: numbers from `low`, dark, to `high`, bright."""

    name: str
    low: float
    high: float
    logarithmic: bool
    panels: Sequence[int]


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
    found = sorted({int(label) for tile in tiles for label in np.unique(tile.labels)})
    legend = [(class_colour(c, colours), "unlabelled" if c < 0 else classes[c]) for c in found]
    panels = [
        Panel(title=tile.title, vertices=tile.vertices, faces=tile.faces, colours=colours_of(tile.labels, colours))
        for tile in tiles
    ]
    sheet(path, panels, columns=columns, title=title, size=size, legend=legend)


def sheet(
    path: Path,
    panels: Sequence[Panel | None],
    *,
    columns: int,
    title: str,
    size: float = 2.4,
    legend: Sequence[tuple[str, str]] = (),
    scales: Sequence[Scale] = (),
) -> None:
    """A PNG of meshes in rows, each `size` inches, None for an empty place. `legend`: colours, hexadecimal, and what
    they mean; a scale stands on the right of its panels, below where they are one row of a sheet of their own."""
    rows = -(-len(panels) // columns)
    figure = Figure(figsize=(size * columns + 0.9 * bool(scales), size * rows + 0.9), layout="constrained")
    figure.suptitle(title, fontsize="medium")
    grid = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes in grid:
        axes.set_axis_off()
    for panel, axes in zip(panels, grid, strict=False):
        if panel is not None:
            axes.imshow(render(panel.vertices, panel.faces, panel.colours, size=round(size * DPI)))
            axes.set_title(panel.title, fontsize="small", y=1)  # a place given is not looked for, axes by axes
    for scale in scales:
        _bar(figure, [grid[number] for number in scale.panels], scale)
    if legend:
        widest = 0.6 + 0.08 * max(len(name) for _, name in legend)  # inches of an entry of the legend
        figure.legend(
            handles=[Patch(color=colour, label=name) for colour, name in legend],
            loc="outside lower center",
            ncols=max(1, min(len(legend), int(size * columns / widest))),
            fontsize="small",
            frameon=False,
        )
    save_figure(figure, path)


def _bar(figure: Figure, beside: Sequence[Axes], scale: Scale) -> None:
    """A colour bar with three numbers."""
    high = scale.high if scale.high > scale.low else scale.low + 1
    norm = LogNorm(scale.low, high) if scale.logarithmic else Normalize(scale.low, high)
    colours = ListedColormap(colours_between(np.linspace(0, 1, 256), 0.0, 1.0) / 255)
    place = "bottom" if len(beside) == 1 else "right"
    bar = figure.colorbar(ScalarMappable(norm, colours), ax=list(beside), location=place, shrink=0.8, aspect=30)
    ticks = (np.geomspace if scale.logarithmic else np.linspace)(scale.low, high, 3)
    bar.set_ticks(ticks.tolist(), labels=[f"{tick:.2g}" for tick in ticks])
    bar.ax.minorticks_off()
    bar.ax.tick_params(labelsize="small")
    bar.set_label(scale.name, fontsize="small")


def curves(path: Path, history: Sequence[dict[str, Any]], *, title: str) -> None:
    """A PNG of training loss, and of the accuracy that chooses the epoch, over epochs."""
    with mpl.rc_context({"axes.grid": True, "grid.alpha": 0.3}):
        figure = Figure(figsize=(8, 3), layout="constrained")
        figure.suptitle(title, fontsize="medium")
        left, right = figure.subplots(1, 2)
        epochs = [row["epoch"] for row in history]
        plot_loss(left, history)
        right.plot(epochs, [100 * judged(row)[1] for row in history], color=class_colour(3))
        right.set(xlabel="epoch", ylabel=f"{judged(history[-1])[0].split(' (')[0]}, %")
        save_figure(figure, path)


def plot_loss(axes: Axes, history: Sequence[dict[str, Any]]) -> None:
    """Training loss over epochs."""
    axes.plot([row["epoch"] for row in history], [row["loss"] for row in history], color=class_colour(0))
    axes.set(xlabel="epoch", ylabel="training loss")


def confusions(
    path: Path, counts: Mapping[str, Int[np.ndarray, "K K"]], classes: Sequence[str], *, title: str
) -> None:
    """A PNG of confusion matrices side by side, named by their keys: a row is a true class, a cell how many per
    cent of it were predicted as the class of the column. A class that is not there has an empty row."""
    side = max(2.5, 0.3 * len(classes))
    figure = Figure(figsize=(side * len(counts) + 2, side + 2.4), layout="constrained")
    figure.suptitle(title, fontsize="medium")
    names = [name if len(name) <= 20 else f"{name[:19]}…" for name in classes]
    grid = figure.subplots(1, len(counts), squeeze=False)[0]
    for axes, (kind, matrix) in zip(grid, counts.items(), strict=True):
        total = matrix.sum(axis=1, keepdims=True)
        shares = np.divide(100.0 * matrix, total, out=np.full(matrix.shape, np.nan), where=total > 0)
        axes.imshow(shares, cmap="Blues", vmin=0, vmax=100, aspect="auto")
        axes.set_xticks(range(len(names)), names, rotation=90, fontsize="small")
        axes.set_yticks(range(len(names)), names if axes is grid[0] else [""] * len(names), fontsize="small")
        axes.set(title=kind, xlabel="predicted")
        for true, row in enumerate(shares):
            for predicted, share in enumerate(row):
                if share >= 0.5:
                    ink = "white" if share > 60 else "black"
                    axes.text(predicted, true, f"{share:.0f}", ha="center", va="center", fontsize=7, color=ink)
    grid[0].set_ylabel("true, % of its row")
    save_figure(figure, path)


def save_figure(figure: Figure, path: Path) -> None:
    """The figure as a PNG; letters that the font lacks are drawn as boxes."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph .* missing")  # a name may be in any script
        figure.savefig(path, dpi=DPI)
