"""A table as a picture: the paper's figure, and every run under both protocols."""

from collections.abc import Sequence
from pathlib import Path
from statistics import fmean

from matplotlib.figure import Figure

from meshshard.palette import class_colour
from meshshard_train.pictures import save_figure
from meshshard_train.reproduce.figures import Runs

MARKS = {"published": ("s", 1, 0.16), "honest": ("o", 0, -0.16)}
"""Protocol -> its mark, colour, and place beside the middle of its line."""


def plot(path: Path, title: str, lines: Sequence[dict[str, Runs]]) -> None:
    """A PNG: a row for each line; a mark for each run, a stroke at their mean, and a diamond for the paper."""
    figure = Figure(figsize=(7, 1.4 + 0.55 * len(lines)), layout="constrained")
    axes = figure.subplots()
    for place, by_protocol in enumerate(lines):
        for protocol, (mark, colour, offset) in MARKS.items():
            runs = by_protocol[protocol]
            values = runs.values(runs.figure)
            heights = [place - offset] * len(values)
            label = f"{protocol}, every run and mean" if place == 0 else None
            axes.plot(values, heights, mark, color=class_colour(colour), alpha=0.6, markersize=6, label=label)
            if values:
                axes.plot(
                    [fmean(values)] * 2, [place - offset - 0.12, place - offset + 0.12], color=class_colour(colour)
                )
        paper = by_protocol["honest"].line.paper
        if paper is not None:
            axes.plot(paper, place, "D", color="black", markersize=5, label="paper" if place == 0 else None)
    axes.set_yticks(range(len(lines)), [by_protocol["honest"].line.name for by_protocol in lines])
    axes.set(title=title, xlabel="test accuracy, %", ylim=(len(lines) - 0.5, -0.5))
    axes.grid(alpha=0.3)
    figure.legend(loc="outside lower center", ncols=3, fontsize="small", frameon=False)
    save_figure(figure, path)
