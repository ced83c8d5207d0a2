"""Every mesh of a data set looked at once: what its card and its page are made of."""

from collections import Counter
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64, Int64

from meshshard.dataset import Dataset
from meshshard.sample import DIAGNOSTICS, Sample
from meshshard.splits import SPLITS


@dataclass(frozen=True, kw_only=True)
class Survey:
    """N meshes in the order of the data set, S splits, C classes, D diagnostics.

    split: of each mesh, its place in `splits`: train, val and test where one of them is there, then others.
    labelled: meshes whose "faces", "vertices" or, of neither, "meshes" carry the labels that are counted here.
    class_counts, class_areas: how many have a class, and their surface in squared radii of their meshes, 0 for whole
    meshes; class_meshes: meshes that have the class; unlabelled: how many have the label -1.
    typical: for each class the first mesh of those where its share is largest; -1 where no mesh has it.
    """

    labelled: Counter[str]
    splits: tuple[str, ...]
    split: Int64[np.ndarray, " N"]
    vertices: Int64[np.ndarray, " N"]
    faces: Int64[np.ndarray, " N"]
    diagnostics: Int64[np.ndarray, "N D"]
    hks_error_bound: Float64[np.ndarray, " N"]
    mesh_label: Int64[np.ndarray, " N"]
    class_counts: Int64[np.ndarray, "S C"]
    class_areas: Float64[np.ndarray, "S C"]
    class_meshes: Int64[np.ndarray, "S C"]
    unlabelled: Int64[np.ndarray, " S"]
    typical: Int64[np.ndarray, " C"]
    label_domains: Counter[str]
    label_rules: Counter[str]

    @property
    def affected(self) -> Bool[np.ndarray, "N D"]:
        """Meshes that have something of each diagnostic: of `components`, more than one."""
        ordinary = np.array([name == "components" for name in DIAGNOSTICS])
        return self.diagnostics > ordinary


def survey(dataset: Dataset) -> Survey:
    """Read every sample once; a mesh at a time is in memory, and a few numbers of each."""
    splits = _splits_of(dataset)
    size, classes = len(dataset), len(dataset.classes)
    split = np.array([splits.index(name) for name in dataset.index.splits], dtype=np.int64)
    faces, mesh_label = np.zeros(size, dtype=np.int64), np.full(size, -1, dtype=np.int64)
    diagnostics = np.zeros((size, len(DIAGNOSTICS)), dtype=np.int64)
    bound = np.zeros(size)
    counts, areas = np.zeros((len(splits), classes), dtype=np.int64), np.zeros((len(splits), classes))
    meshes, unlabelled = np.zeros_like(counts), np.zeros(len(splits), dtype=np.int64)
    typical, largest = np.full(classes, -1, dtype=np.int64), np.zeros(classes)
    domains: Counter[str] = Counter()
    rules: Counter[str] = Counter()
    labelled: Counter[str] = Counter()
    for number in range(size):
        sample, row = dataset[number], split[number]
        faces[number], mesh_label[number] = len(sample.faces), sample.mesh_label
        diagnostics[number] = [sample.diagnostics[name] for name in DIAGNOSTICS]
        bound[number] = sample.hks_error_bound
        domains[sample.label_domain] += 1
        rules[sample.label_rule] += 1
        what, labels, surface = _labels(sample)
        labelled[what] += 1
        known = labels >= 0
        found = np.bincount(labels[known], minlength=classes)
        counts[row] += found
        areas[row] += np.bincount(labels[known], weights=surface[known], minlength=classes)
        meshes[row] += found > 0
        unlabelled[row] += len(labels) - found.sum()
        share = found / max(found.sum(), 1)
        typical[share > largest] = number
        largest = np.maximum(largest, share)
    return Survey(
        labelled=labelled,
        splits=splits,
        split=split,
        vertices=np.array(dataset.vertex_counts, dtype=np.int64),
        faces=faces,
        diagnostics=diagnostics,
        hks_error_bound=bound,
        mesh_label=mesh_label,
        class_counts=counts,
        class_areas=areas,
        class_meshes=meshes,
        unlabelled=unlabelled,
        typical=typical,
        label_domains=domains,
        label_rules=rules,
    )


def _splits_of(dataset: Dataset) -> tuple[str, ...]:
    """All three usual splits where one of them is there, so that an empty one shows; those without a name last."""
    found = set(dataset.index.splits)
    usual = SPLITS if found & set(SPLITS) else ()
    return (*usual, *sorted(found - {*usual, ""}), *({""} & found))


def _labels(sample: Sample) -> tuple[str, np.ndarray, np.ndarray]:
    """What is labelled, with which classes, and how much surface each has."""
    if sample.face_labels is not None:
        return "faces", sample.face_labels, sample.face_areas
    if sample.vertex_labels is not None:
        return "vertices", sample.vertex_labels, sample.vertex_areas
    return "meshes", np.array([sample.mesh_label]), np.zeros(1)
