"""What a mesh can be coloured by: colours of its vertices or faces, and the legend that says what they mean."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

import numpy as np
from jaxtyping import Float, Int, UInt8

from meshshard.palette import VIRIDIS, class_colour, colours_between, colours_of
from meshshard.sample import Sample
from meshshard.view.opinion import Opinion, true_labels

LABEL, PREDICTION, ERRORS = "label", "prediction", "errors"
HKS, DIHEDRAL, NORMALS = "heat kernel signature", "mean dihedral angle", "normals"
NOTHING = "nothing"

FOLDED = 90.0
"""Degrees: mean turning angle from which on vertices are yellow."""

OUTLIERS = 1.0
"""Per cent of the vertices at each end of a mesh's HKS, which have the colours of the ends."""

SMALLEST = float(np.finfo(np.float32).tiny)
"""Taken for the HKS of vertices that no face uses, which is 0."""


@dataclass(frozen=True, eq=False)
class Coloured:
    """Colours of the faces or of the vertices of a mesh, and as HTML what they mean."""

    colours: UInt8[np.ndarray, "n 3"]
    of_faces: bool
    legend: str

    def corners(self, faces: Int[np.ndarray, "F 3"]) -> UInt8[np.ndarray, "F 3"] | UInt8[np.ndarray, "F 3 3"]:
        """What `render` takes."""
        return self.colours if self.of_faces else self.colours[faces]


@dataclass(frozen=True)
class Classes:
    """Names of classes, and their colours in hexadecimal, or none for the palette's."""

    names: tuple[str, ...]
    colours: tuple[str, ...]


VERDICTS = Classes(("right", "wrong"), ("#56B4E9", "#D55E00"))


def choices(labelled: bool, judged: bool) -> list[str]:
    """What meshes can be coloured by, with labels and with a network or without, what tells most first."""
    return [
        *[LABEL] * labelled,
        *[PREDICTION] * judged,
        *[ERRORS] * (labelled and judged),
        *(HKS, DIHEDRAL, NORMALS),
    ]


def coloured(
    what: str, sample: Sample, time: int, element: str, classes: Classes, opinion: Opinion | None
) -> Coloured:
    """A mesh coloured by one of the `choices`. `time`: number of a diffusion time; `element`: what is labelled."""
    if what == HKS:
        return _of_hks(sample, time)
    if what == DIHEDRAL:
        angles = np.rad2deg(sample.dihedral.astype(np.float64))
        legend = _scale("0° (flat)", f"{FOLDED:g}° and more")
        return Coloured(colours_between(angles, 0.0, FOLDED), False, legend)
    if what == NORMALS:
        legend = _rows([("#FF8080", "towards x", ""), ("#80FF80", "towards y", ""), ("#8080FF", "towards z", "")])
        return Coloured(np.rint(255 * (sample.vertex_normals + 1) / 2).astype(np.uint8), False, legend)
    labels = true_labels(sample, element)
    if opinion and what == PREDICTION:
        labels = opinion.labels
    if opinion and what == ERRORS:
        labels, classes = np.where(labels < 0, -1, opinion.labels != labels), VERDICTS
    each = np.full(len(sample.faces), labels[0]) if element == "mesh" else labels
    return Coloured(colours_of(each, classes.colours), element != "vertices", _class_legend(labels, classes))


def _of_hks(sample: Sample, time: int) -> Coloured:
    """By its logarithm: it differs by orders of magnitude over a mesh, and tips would hide all else."""
    values: Float[np.ndarray, " V"] = np.log(np.maximum(sample.hks[:, time].astype(np.float64), SMALLEST))
    low, high = np.percentile(values[sample.used_vertices], [OUTLIERS, 100 - OUTLIERS]).tolist()
    legend = _scale(f"{math.exp(low):.3g}", f"{math.exp(high):.3g} / squared radii")
    legend += (
        f"<div>on a logarithmic scale, at t = {sample.times[time]:.3g} squared radii; {OUTLIERS:g} % of the vertices "
        "beyond each end</div>"
    )
    return Coloured(colours_between(values, low, high), False, legend)


def _class_legend(labels: Int[np.ndarray, " n"], classes: Classes) -> str:
    found, counts = np.unique(labels, return_counts=True)
    return _rows(
        [
            (class_colour(k, classes.colours), name_of(k, classes), f"{100 * count / len(labels):.1f} %")
            for k, count in zip(found.tolist(), counts.tolist(), strict=True)
        ]
    )


def name_of(label: int, classes: Classes) -> str:
    """Of a class; -1 is unlabelled."""
    return "unlabelled" if label < 0 else classes.names[label]


def _scale(low: str, high: str) -> str:
    return (
        f'<div style="height:1em;background:linear-gradient(to right,{",".join(VIRIDIS)})"></div>'
        f'<div style="display:flex;justify-content:space-between"><span>{low}</span><span>{high}</span></div>'
    )


def _rows(rows: Sequence[tuple[str, str, str]]) -> str:
    """A colour, a name and a number a row."""
    square = '<span style="width:1em;height:1em;margin-right:.5em;background:{}"></span>'
    return "".join(
        f'<div style="display:flex;align-items:center">{square.format(colour)}'
        f'<span style="flex:1">{escape(name)}</span><span>{number}</span></div>'
        for colour, name, number in rows
    )
