"""Labels as a text file for other tools: one integer a line, and what each line is of."""

import numpy as np
from jaxtyping import Float, Float64, Int, Int64

from meshshard.recipe import Recipe
from meshshard.sample import Sample


def line_note(recipe: Recipe, domain: str) -> str:
    """What users are told where lines are not of the mesh file; empty where they are. `domain`: "face", "edge" or
    "vertex". Faces are traced back through steps, for each triangle comes from one; not through simplify. Vertices
    and edges are not: what a step merged or left out is not in the shard."""
    if domain == "face":
        return "each line is of a face of the simplified mesh, not of the mesh file" if recipe.simplify else ""
    what = {"edge": "an edge", "vertex": "a vertex"}[domain]
    changed = f"each line is of {what} of the stored mesh, which the recipe changed, not of the mesh file"
    return changed if recipe.changes_mesh else ""


def line_labels(sample: Sample, labels: Int[np.ndarray, " F"], recipe: Recipe) -> Int[np.ndarray, " L"]:
    """The labels of a mesh's triangles as its label file has them: a line for each face of the mesh file, in its
    order. `labels`: class index of each stored triangle, -1 unlabelled. `recipe`: by which the mesh was stored.

    A polygon has the label that most of its triangles have, the lowest of several, and -1 where a step left out all
    of them. Simplified triangles lie on no one face: with a recipe that simplifies, each has a line of its own.
    """
    return labels if recipe.simplify else most_common(sample.face_source, labels, sample.polygons)


def line_confidence(
    sample: Sample, lines: Int[np.ndarray, " L"], probabilities: Float[np.ndarray, "F K"], recipe: Recipe
) -> Float64[np.ndarray, " L"]:
    """How probable the label of each line of `line_labels` is: the mean over the triangles of its face. 0 for a line
    without a label. `probabilities`: of each class, for each stored triangle."""
    line_F = np.arange(len(sample.faces)) if recipe.simplify else sample.face_source
    of_line_F = probabilities[np.arange(len(line_F)), lines[line_F]]
    return np.bincount(line_F, of_line_F, len(lines)) / np.maximum(np.bincount(line_F, minlength=len(lines)), 1)


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
