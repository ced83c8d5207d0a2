"""A data set in numbers."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from meshshard.dataset import open_dataset
from meshshard.sample import DIAGNOSTICS, Sample


def data_card(folder: Path) -> dict[str, Any]:
    """Sizes and class shares of each split, sums of the diagnostics, the largest error bound; ready for JSON.

    `class_shares` are of the labelled faces, vertices or meshes: whatever the data set labels.
    """
    dataset = open_dataset(folder)
    splits = {}
    diagnostics = dict.fromkeys(DIAGNOSTICS, 0)
    bound = 0.0
    for split, numbers in dataset.splits.items():
        counts = np.zeros(len(dataset.classes), dtype=np.int64)
        vertices = faces = 0
        for number in numbers:
            sample = dataset[number]
            vertices, faces = vertices + len(sample.vertices), faces + len(sample.faces)
            counts += np.bincount(_labels(sample), minlength=len(counts))
            bound = max(bound, sample.hks_error_bound)
            for name, count in sample.diagnostics.items():
                diagnostics[name] += count
        splits[split] = {
            "meshes": len(numbers),
            "vertices": vertices,
            "faces": faces,
            "class_shares": (counts / max(counts.sum(), 1)).tolist(),
        }
    return {
        "folder": str(folder),
        "dataset": dataset.name,
        "task": dataset.task,
        "classes": list(dataset.classes),
        "recipe": json.loads(dataset.recipe.to_json()),
        "algorithm_version": dataset.index.algorithm_version,
        "splits": splits,
        "splits_sha256": dataset.index.splits_sha256,
        "diagnostics": diagnostics,
        "hks_error_bound": bound,
        "refused": len(dataset.index.refused),
        "failed": len(dataset.index.failed),
    }


def _labels(sample: Sample) -> np.ndarray:
    for labels in (sample.face_labels, sample.vertex_labels):
        if labels is not None:
            return labels[labels >= 0]
    return np.array([sample.mesh_label] if sample.mesh_label >= 0 else [], dtype=np.int64)
