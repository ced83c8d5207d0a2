"""Meshes of a data set in rows, coloured alike, from the same side: a picture for an article or a page."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from meshshard import Dataset, Sample, UsageError
from meshshard.export.ply import feature_of
from meshshard.palette import class_colour, colours_between
from meshshard.view.colouring import ERRORS, FOLDED, LABEL, OUTLIERS, PREDICTION, VERDICTS, Classes, coloured, name_of
from meshshard.view.opinion import Judge, Opinion, labelled_element, true_labels
from meshshard_train.pictures import Panel, Scale, sheet

HKS, DIHEDRAL = "hks", "dihedral"


@dataclass(kw_only=True)
class _Row:
    """The meshes in one colouring, and what its colours mean."""

    panels: list[Panel]
    legend: Sequence[tuple[str, str]] = ()
    scale: tuple[str, float, float, bool] | None = None


def draw_gallery(
    path: Path,
    dataset: Dataset,
    numbers: Sequence[int],
    colours: Sequence[str],
    judge: Judge | None,
    *,
    columns: int,
    title: str,
) -> None:
    """Write a PNG. `colours`: "label", "prediction", "errors", or a feature of vertices as "dihedral", "hks:3", or
    "hks" for the time in the middle; with several, each row of meshes is there in each of them, one below the other,
    and a mesh alone has them side by side.

    Numbers have the same colour in all meshes of a picture: HKS on a logarithmic scale; the outermost per cent at
    each end have the colours of the ends. UsageError: nothing is labelled, no network, or no such feature.
    """
    samples = [dataset[number] for number in numbers]
    opinions: list[Opinion | None] = [None] * len(samples)
    if judge is not None and {PREDICTION, ERRORS} & set(colours):
        opinions = list(judge.opinions(numbers))
    rows = [_row(colour, dataset, samples, opinions, judge) for colour in colours]
    columns = len(rows) if len(samples) == 1 else min(columns, len(samples))
    panels: list[Panel | None] = []
    places: list[list[int]] = [[] for _ in rows]
    for start in range(0, len(samples), columns):
        for row, own in zip(rows, places, strict=True):
            some = row.panels[start : start + columns]
            own += range(len(panels), len(panels) + len(some))
            panels += some
            panels += [None] * (columns - len(some) if len(samples) > 1 else 0)
    sheet(
        path,
        panels,
        columns=columns,
        title=title,
        legend=_legend(dict(zip(colours, rows, strict=True))),
        scales=[
            Scale(name=row.scale[0], low=row.scale[1], high=row.scale[2], logarithmic=row.scale[3], panels=own)
            for row, own in zip(rows, places, strict=True)
            if row.scale
        ],
    )


def _legend(rows: Mapping[str, _Row]) -> list[tuple[str, str]]:
    """Every entry once. What is right and wrong is named after its row where classes have colours too."""
    alone = not any(row.legend for colour, row in rows.items() if colour != ERRORS)
    found = [
        (shade, name if alone or colour != ERRORS else f"{ERRORS}: {name}")
        for colour, row in rows.items()
        for shade, name in row.legend
    ]
    return list(dict.fromkeys(found))


def spread(numbers: Sequence[int], count: int) -> list[int]:
    """Up to `count` of them, at even distances."""
    places = np.linspace(0, len(numbers) - 1, min(count, len(numbers))).round().astype(int)
    return [numbers[place] for place in places]


def _row(
    colour: str,
    dataset: Dataset,
    samples: Sequence[Sample],
    opinions: Sequence[Opinion | None],
    judge: Judge | None,
) -> _Row:
    if colour in (PREDICTION, ERRORS) and judge is None:
        raise UsageError(f"--colour {colour} is for the folder of a run; of a data set: label, dihedral, hks")
    if colour not in (LABEL, PREDICTION, ERRORS):
        return _of_feature(colour, samples)
    names = judge.classes if judge else dataset.classes
    if not names:
        raise UsageError(f"{dataset.folder} has no labels; try --colour hks or --colour dihedral")
    classes = Classes(names, judge.colours if judge else dataset.index.colours)
    panels: list[Panel] = []
    found: set[int] = set()
    for sample, opinion in zip(samples, opinions, strict=True):
        element = judge.element if judge else labelled_element(sample)
        drawn = coloured(colour, sample, 0, element, classes, opinion).corners(sample.faces)
        panels.append(_panel(sample, drawn, _said(colour, judge, opinion, sample)))
        truth = true_labels(sample, element)
        if colour == ERRORS and opinion is not None:
            truth = np.where(truth < 0, -1, opinion.labels != truth)
        found |= set((opinion.labels if opinion and colour == PREDICTION else truth).tolist())
    classes = VERDICTS if colour == ERRORS else classes
    legend = [(class_colour(k, classes.colours), name_of(k, classes)) for k in sorted(found)]
    return _Row(panels=panels, legend=legend)


def _said(colour: str, judge: Judge | None, opinion: Opinion | None, sample: Sample) -> str:
    """What stands above a mesh: its name; above a prediction how right it is."""
    if colour == LABEL or judge is None or opinion is None:
        return sample.id.split("/")[-1][:24]
    if judge.element == "mesh":
        return judge.classes[int(opinion.labels[0])][:24]
    return "predicted" if math.isnan(opinion.score) else f"predicted, {100 * opinion.score:.1f} % right"


def _of_feature(colour: str, samples: Sequence[Sample]) -> _Row:
    name = f"{HKS}:{len(samples[0].times) // 2}" if colour == HKS else colour
    values = [feature_of(sample, name).astype(np.float64) for sample in samples]
    logarithmic = name.startswith(f"{HKS}:")
    words, low, high = name, 0.0, FOLDED
    if name == DIHEDRAL:
        values, words = [np.rad2deg(angles) for angles in values], f"dihedral angle, degrees, {FOLDED:g} and more"
    else:
        known = np.concatenate([of[sample.used_vertices] for of, sample in zip(values, samples, strict=True)])
        low, high = np.percentile(known, [OUTLIERS, 100 - OUTLIERS]).tolist()
    if logarithmic:
        words = f"HKS at t = {samples[0].times[int(name.split(':')[1])]:.3g} squared radii"
    panels = [
        _panel(sample, _shades(of, low, high, logarithmic)[sample.faces], sample.id.split("/")[-1][:24])
        for of, sample in zip(values, samples, strict=True)
    ]
    return _Row(panels=panels, scale=(words, low, high, logarithmic))


def _shades(values: Float[np.ndarray, " V"], low: float, high: float, logarithmic: bool) -> np.ndarray:
    if logarithmic:
        values = np.log(np.maximum(values, low))  # 0 at vertices of no face
        low, high = math.log(low), math.log(high)
    return colours_between(values, low, high)


def _panel(sample: Sample, colours: np.ndarray, title: str) -> Panel:
    return Panel(title=title, vertices=sample.vertices, faces=sample.faces, colours=colours)
