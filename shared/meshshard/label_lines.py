"""Labels as a text file for other tools: one integer a line, and what each line is of."""

import numpy as np
from jaxtyping import Int, Int64

from meshshard.recipe import Recipe
from meshshard.sample import Sample

SIMPLIFIED = "each line is of a face of the simplified mesh, not of the mesh file"
"""What users are told where `line_labels` are of stored triangles."""


def line_labels(sample: Sample, labels: Int[np.ndarray, " F"], recipe: Recipe) -> Int[np.ndarray, " L"]:
    """The labels of a mesh's triangles as its label file has them: a line for each face of the mesh file, in its
    order. `labels`: class index of each stored triangle, -1 unlabelled. `recipe`: by which the mesh was stored.

    A polygon has the label that most of its triangles have, the lowest of several, and -1 where a step left out all
    of them. Simplified triangles lie on no one face: with a recipe that simplifies, each has a line of its own.
    """
    return labels if recipe.simplify else most_common(sample.face_source, labels, sample.polygons)


def as_lines(labels: Int[np.ndarray, " L"]) -> bytes:
    """One integer a line."""
    return "".join(f"{label}\n" for label in labels.tolist()).encode()


def most_common(
    owners: Int[np.ndarray, " N"], labels: Int[np.ndarray, " N"], count: int
) -> Int64[np.ndarray, " count"]:
    """The label that most entries of each owner have, 0 to count - 1. Ties go to the lowest label; -1 does not count,
    and is what an owner without any label gets."""
    result = np.full(count, -1)
    labelled = labels >= 0
    span = int(labels.max(initial=0)) + 1
    pairs, votes = np.unique(owners[labelled].astype(np.int64) * span + labels[labelled], return_counts=True)
    owner, label = np.divmod(pairs, span)
    order = np.lexsort((label, -votes, owner))
    winners, first = np.unique(owner[order], return_index=True)
    result[winners] = label[order][first]
    return result
