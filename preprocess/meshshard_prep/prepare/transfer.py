"""Labels of the file, on the mesh that the steps made of it."""

from dataclasses import replace

import numpy as np
from jaxtyping import Int16

from meshshard_prep.labels import UNLABELLED, Labels
from meshshard_prep.prepare.traced import Traced

LAST = 2**15
"""Stands for unlabelled where labels are ordered; labels are below."""


def carried(labels: Labels, mesh: Traced) -> tuple[Labels, dict[str, int]]:
    """Labels of the stored mesh, and how many of its faces lie on two labels or more.

    A vertex has the label of its source. So has a triangle, and a simplified one the label with the largest share of
    its points: the lowest of equals, unlabelled last.
    """
    simplified = mesh.triangle_sources.shape[1] > 1
    if labels.vertices is not None:
        rule = _joined(labels.rule, "carried to the simplified mesh by the nearest vertex" if simplified else "")
        return replace(labels, vertices=labels.vertices[mesh.vertex_source], rule=rule), {}
    assert labels.faces is not None
    rule = _joined(labels.rule, "carried to the simplified mesh by the majority of area" if simplified else "")
    faces, ambiguous = majority_of_points(labels.faces[mesh.triangle_sources])
    return replace(labels, faces=faces, rule=rule), {"ambiguous_faces": ambiguous}


def majority_of_points(at_points: Int16[np.ndarray, "F S"]) -> tuple[Int16[np.ndarray, " F"], int]:
    """The commonest label of each row, the lowest of equals and unlabelled last; and how many rows have several."""
    label = np.where(at_points == UNLABELLED, LAST, at_points.astype(np.int64))
    pairs, count = np.unique(np.arange(len(label))[:, None] * (LAST + 1) + label, return_counts=True)
    row, label = np.divmod(pairs, LAST + 1)
    order = np.lexsort((label, -count, row))
    winner = label[order][np.unique(row, return_index=True)[1]]
    return np.where(winner == LAST, UNLABELLED, winner).astype(np.int16), int((np.bincount(row) > 1).sum())


def _joined(*rules: str) -> str:
    return "; then ".join(filter(None, rules))
