"""A mesh as the tensors that PyTorch Geometric names pos, face, x and y."""

from collections.abc import Sequence

import numpy as np
import safetensors.torch
import torch
from torch import Tensor

from meshshard import Dataset, Sample, UsageError
from meshshard.export import Exporter
from meshshard.schema import PER_VERTEX

INPUTS = ("hks", "dihedral", "vertex_normals")
"""Fields of vertices that `x` consists of, in this order, each with all its columns."""

KNOWN = tuple(f.name for f in PER_VERTEX if f.dtype == "f4")


def exporter(dataset: Dataset) -> Exporter:
    """The format `pyg`: a safetensors file for each mesh, because PyG's own files are pickles."""
    return Exporter(".safetensors", lambda sample: safetensors.torch.save(graph_of(sample, dataset.task)))


def graph_of(sample: Sample, task: str, inputs: Sequence[str] = INPUTS) -> dict[str, Tensor]:
    """The tensors of one mesh; V vertices, F faces, C columns.

    pos (V,3) float32: normalised. face (3,F) int64. x (V,C) float32: the inputs' columns side by side, unscaled.
    y int64, -1 unlabelled: (F,) of the faces, or (V,) where vertices are labelled, or (1,) for the task
    "classification"; none for "unlabelled" and "correspondence".
    """
    columns = [getattr(sample, name).reshape(len(sample.vertices), -1) for name in inputs]
    graph = {
        "pos": torch.from_numpy(sample.vertices.copy()),
        "face": torch.from_numpy(np.ascontiguousarray(sample.faces.T, dtype=np.int64)),
        "x": torch.from_numpy(np.concatenate(columns, axis=1)),
    }
    if task not in ("unlabelled", "correspondence"):
        graph["y"] = torch.from_numpy(_labels(sample, task).astype(np.int64))
    return graph


def _labels(sample: Sample, task: str) -> np.ndarray:
    if task == "classification":
        return np.array([sample.mesh_label])
    if sample.face_labels is not None:
        return sample.face_labels
    return np.full(len(sample.faces), -1) if sample.vertex_labels is None else sample.vertex_labels


def input_columns(dataset: Dataset, inputs: Sequence[str] = INPUTS) -> tuple[str, ...]:
    """Names of the columns of `x`: hks:0, hks:1 and so on, dihedral, vertex_normals:0 and so on.

    UsageError: an input that is no feature of vertices, or that the data set does not hold.
    """
    first = dataset[0]
    there = [name for name in KNOWN if getattr(first, name) is not None]
    missing = [name for name in inputs if name not in there]
    if missing or not inputs:
        raise UsageError(f"{dataset.folder} has no {missing}; inputs are one or more of {', '.join(there)}")
    widths = [(name, getattr(first, name).size // len(first.vertices)) for name in inputs]
    return tuple(f"{name}:{i}" if width > 1 else name for name, width in widths for i in range(width))
