"""The meshes of a split that a network gets most wrong and most right, as pictures."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch
from jaxtyping import Int

from meshshard import Dataset
from meshshard.data_card.page import picture_of
from meshshard.data_card.tables import shown
from meshshard.sample import Sample
from meshshard.view.colouring import ERRORS, LABEL, PREDICTION, Classes, coloured
from meshshard.view.opinion import Judge, Opinion, true_labels
from meshshard_train.checkpoint import Checkpoint
from meshshard_train.judging import judge_of
from meshshard_train.labelling import known_rounds


def worst_and_best(
    best: Checkpoint, run: Path, dataset: Dataset, numbers: Sequence[int], count: int, device: torch.device
) -> dict[str, Any]:
    """What `meshes` of `report.html` shows: up to `count` meshes of these, half of them the worst, half the best,
    labels beside predictions after the run's rounds of voting, and where these are wrong. Every mesh is judged; those
    without labels have no place, and their number is told."""
    judge = judge_of(best, run, dataset, device)
    scores = [opinion.score for opinion in judge.opinions(numbers)]
    order = sorted(
        (place for place, score in enumerate(scores) if not math.isnan(score)), key=lambda place: scores[place]
    )
    half = min(-(-count // 2), -(-len(order) // 2))
    chosen = {"Worst": order[:half], "Best": order[max(half, len(order) - count // 2) :][::-1]}
    groups = [
        {
            "title": f"{name} {len(places)}" if len(places) > 1 else name,
            "figures": _figures(judge, dataset, [numbers[place] for place in places]),
        }
        for name, places in chosen.items()
        if places
    ]
    return {
        "score": judge.score,
        "parts": judge.element != "mesh",
        "rounds": known_rounds(best, run),
        "judged": len(order),
        "unlabelled": len(scores) - len(order),
        "groups": groups,
    }


def _figures(judge: Judge, dataset: Dataset, numbers: Sequence[int]) -> list[dict[str, Any]]:
    return [
        _figure(judge, dataset[number], opinion)
        for number, opinion in zip(numbers, judge.opinions(numbers), strict=True)
    ]


def _figure(judge: Judge, sample: Sample, opinion: Opinion) -> dict[str, Any]:
    return {
        "id": shown(sample.id),
        "score": f"{100 * opinion.score:.1f} %",
        "faces": f"{len(sample.faces):,} faces",
        "pictures": [
            _picture(what, judge, sample, opinion)
            for what in (LABEL, PREDICTION, *[ERRORS] * (judge.element != "mesh"))
        ],
    }


def _picture(what: str, judge: Judge, sample: Sample, opinion: Opinion) -> dict[str, str]:
    labels = opinion.labels if what == PREDICTION else true_labels(sample, judge.element)
    drawn = coloured(what, sample, 0, judge.element, Classes(judge.classes, judge.colours), opinion)
    said = judge.classes[int(labels[0])] if judge.element == "mesh" else ""
    words = said or _shares(labels, judge.classes)
    if what == ERRORS:
        words = f"{100 * (1 - opinion.score):.1f} % wrong"
    return {
        "name": what,
        "said": shown(said),
        "image": picture_of(sample, drawn.corners(sample.faces)),
        "alt": shown(f"mesh {sample.id}, {what}: {words}"),
    }


def _shares(labels: Int[np.ndarray, " n"], classes: Sequence[str]) -> str:
    """Of the classes, the largest first."""
    known = labels[labels >= 0]
    shares = np.bincount(known, minlength=len(classes)) / max(len(known), 1)
    order = [int(number) for number in np.argsort(-shares, kind="stable") if shares[number] >= 0.005]
    return ", ".join(f"{classes[number]} {100 * shares[number]:.0f} %" for number in order)
