"""What is learned: classes of faces, of vertices, or of meshes, or which vertex is which. See `config.TASKS`."""

import numpy as np
from jaxtyping import Float32, Int

from meshshard import Dataset, Sample, UsageError
from meshshard_train.config import TrainConfig

LABELS = {"segmentation": "face_labels", "vertex_segmentation": "vertex_labels"}
"""Task -> the field of a shard that it learns."""
RECIPES_WITH = {"dihedral_official": "official", "geodesic": "best", "shape_diameter": "best"}
"""Field -> the named feature recipe that computes it."""


def task_of(dataset: Dataset) -> str:
    """The training task that a data set is for; where shards have labels of faces and of vertices, those of faces
    are learned. UsageError: it has no labels."""
    if dataset.task in ("classification", "correspondence"):
        return dataset.task
    if dataset.task != "segmentation":
        raise UsageError(f"{dataset.folder} has no labels, and training needs them; see docs/datasets.md")
    fields = _fields(dataset)
    return "segmentation" if "face_labels" in fields or "vertex_labels" not in fields else "vertex_segmentation"


def check_task(dataset: Dataset, config: TrainConfig) -> None:
    """Refuse a data set that has not what the configuration learns, by name."""
    found, fields = task_of(dataset), _fields(dataset)
    if found != config.task:
        raise UsageError(f"{dataset.folder} is a data set for {found}, the run is for {config.task}")
    if (wanted := LABELS.get(config.task, "")) and wanted not in fields:
        raise UsageError(
            f"{dataset.folder} has shards without {wanted}, and training needs one kind of labels in all: write "
            'to = "face" or to = "vertex" into the table [labels] of the data set\'s TOML file'
        )
    if config.task == "correspondence":
        _check_spectra(dataset, config, fields)
    for name in config.features:
        if name not in fields:
            advice = "compute features with a recipe that has it (docs/features.md)"
            if recipe := RECIPES_WITH.get(name):
                there = f"data/features/{dataset.name}/{recipe}"
                advice = f"type meshshard features {dataset.name} --recipe {recipe}, and train on {there}"
            raise UsageError(f"{dataset.folder} has no {name}: its recipe is {dataset.recipe.name}; {advice}")


def _check_spectra(dataset: Dataset, config: TrainConfig, fields: frozenset[str]) -> None:
    if "correspondence" not in fields:
        raise UsageError(
            f"{dataset.folder} has shards without correspondence, the vertex of each mesh at every vertex of a "
            "template: faust, scape, faust_r and scape_r have it (docs/correspondence.md)"
        )
    if (stored := dataset.recipe.spectrum) < config.eigenfunctions:
        raise UsageError(
            f"{dataset.folder} has {stored} eigenpairs of each mesh, and functional maps need "
            f"{config.eigenfunctions}: compute them with meshshard features {dataset.name} --spectrum "
            f"{config.eigenfunctions}"
        )


def _fields(dataset: Dataset) -> frozenset[str]:
    """Names of the fields that every shard has."""
    shards = [frozenset(dataset.shard(place).columns) for place in range(len(dataset.index.shards))]
    return frozenset.intersection(*shards) if shards else frozenset()


def labels_of(sample: Sample, task: str) -> Int[np.ndarray, " n"]:
    """Classes of what the task labels, one for a whole mesh, none for correspondence. -1 is not learned and not
    counted: where none is known, and vertices without features, for they are of no face."""
    if task == "classification":
        return np.array([sample.mesh_label])
    if task == "correspondence":
        return np.zeros(0, dtype=np.int64)
    labels: np.ndarray | None = getattr(sample, LABELS[task])
    if task == "vertex_segmentation":
        return np.full(len(sample.vertices), -1) if labels is None else np.where(sample.used_vertices, labels, -1)
    return np.full(len(sample.faces), -1) if labels is None else labels


def of_corners(labels: Int[np.ndarray, " n"], sample: Sample, task: str) -> Int[np.ndarray, "F ..."]:
    """What `pictures.Tile` draws: labels of faces as they are, those of vertices at the corners of faces, (F, 3)."""
    return labels[sample.faces] if task == "vertex_segmentation" else labels


def areas_of(sample: Sample, task: str) -> Float32[np.ndarray, " n"]:
    """Area of each face, or of each vertex; 1 for a whole mesh."""
    if task == "segmentation":
        return sample.face_areas
    return sample.vertex_areas if task == "vertex_segmentation" else np.ones(1, dtype=np.float32)
