"""What a network says of the meshes of a data set, as far as a page shows it. Whoever has a network provides it."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Int

from meshshard.sample import Sample

ELEMENTS = ("faces", "vertices", "mesh")
"""What may be labelled: each face, each vertex, or the mesh as a whole."""


@dataclass(frozen=True, eq=False)
class Opinion:
    """Of one mesh. `labels`: classes of its faces or vertices, or one of the mesh, -1 for none. `score`: how right
    they are, 0 to 1, NaN where nothing is labelled."""

    labels: Int[np.ndarray, " n"]
    score: float


@dataclass(frozen=True, kw_only=True)
class Judge:
    """A network. `name`: its run; `classes`: what its labels mean, and `colours`, of these or none, hexadecimal;
    `element`: one of ELEMENTS, what it labels; `score`: what the score of an opinion
    is, in a word or two; `opinions`: of the meshes with these numbers in the data set, in order."""

    name: str
    classes: tuple[str, ...]
    colours: tuple[str, ...]
    element: str
    score: str
    opinions: Callable[[Sequence[int]], Iterator[Opinion]]


def labelled_element(sample: Sample) -> str:
    """What carries the labels of a mesh: faces before vertices before the mesh itself."""
    if sample.face_labels is not None:
        return "faces"
    return "mesh" if sample.vertex_labels is None else "vertices"


def true_labels(sample: Sample, element: str) -> Int[np.ndarray, " n"]:
    """Classes of the faces, of the vertices, or, one, of the mesh; -1 where none is known, and at vertices of no
    face."""
    if element == "faces":
        return np.full(len(sample.faces), -1) if sample.face_labels is None else sample.face_labels
    if element == "vertices":
        labels = -1 if sample.vertex_labels is None else sample.vertex_labels
        return np.where(sample.used_vertices, labels, -1)
    return np.array([sample.mesh_label])
