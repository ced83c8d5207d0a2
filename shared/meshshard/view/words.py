"""What is said of a mesh and of a corner of it, as HTML. Names of files and classes are escaped."""

import math
from html import escape

import numpy as np

from meshshard.dataset import Dataset
from meshshard.sample import Sample
from meshshard.view.colouring import Classes, name_of
from meshshard.view.opinion import Judge, Opinion, true_labels


def block(content: str) -> str:
    """HTML as far from the borders of a panel as its controls, and in their size."""
    return f'<div style="padding:.3em .8em;font-size:.85em;overflow-wrap:anywhere">{content}</div>'


def end_of(name: str, letters: int) -> str:
    """A name, or so much of its end as fits: that tells it from its neighbours."""
    return name if len(name) <= letters else f"…{name[1 - letters :]}"


def of_mesh(dataset: Dataset, number: int, sample: Sample, judge: Judge | None, opinion: Opinion | None) -> str:
    """Its id, split and size, and how right a network is on it."""
    split = dataset.index.splits[number] or "no split"
    words = f"{escape(split)}, {len(sample.vertices):,} vertices, {len(sample.faces):,} faces"
    if judge and opinion and not math.isnan(opinion.score):
        words += f"; {judge.score} {100 * opinion.score:.1f} %"
    return block(f"<b>{escape(sample.id)}</b><br>{words}")


def of_corner(sample: Sample, face: int, vertex: int, element: str, classes: Classes, opinion: Opinion | None) -> str:
    """The vertex and its dihedral angle; label and prediction there, where there are classes."""
    words = [f"vertex {vertex}: mean dihedral angle {np.rad2deg(sample.dihedral[vertex]):.1f}°"]
    where, place = {"faces": (f"face {face}", face), "vertices": ("vertex", vertex), "mesh": ("mesh", 0)}[element]
    said = {"label": true_labels(sample, element)} | ({"prediction": opinion.labels} if opinion else {})
    if classes.names:
        words += [f"{where}: {what} {escape(name_of(int(labels[place]), classes))}" for what, labels in said.items()]
    return block("<br>".join(words))
