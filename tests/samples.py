"""Samples and small data sets for tests of shards and training, made without computing a feature."""

from itertools import pairwise
from pathlib import Path

import numpy as np
from shapes import bumpy

from meshshard.files import publish, sha256_of
from meshshard.index import Index
from meshshard.recipe import RECIPES
from meshshard.sample import Sample
from meshshard.writer import entry_of, shard_image

PAPER = RECIPES["paper"]


def sample(number=0, *, level=1, recipe=PAPER, labels="faces", **names):
    """A sample with random features and plausible ranges; face labels are height bands, so they can be learned."""
    rng = np.random.default_rng(number)
    vertices, faces = bumpy(number, level)
    vertices = vertices / np.linalg.norm(vertices, axis=1).max()
    size, height = len(vertices), vertices[faces].mean(axis=1)[:, 1]
    values = {
        "vertices": vertices.astype("f4"),
        "vertex_normals": (vertices / np.linalg.norm(vertices, axis=1, keepdims=True)).astype("f4"),
        "dihedral": rng.random(size).astype("f4"),
        "hks": rng.uniform(0.5, 30, (size, len(recipe.times))).astype("f4"),
        "vertex_areas": rng.uniform(0.01, 0.1, size).astype("f4"),
        "faces": faces.astype("i4"),
        "face_adjacency": np.full(faces.shape, -1, dtype="i4"),
        "face_source": np.arange(len(faces), dtype="i4"),
        "times": np.array(recipe.times),
        "centre": rng.random(3),
        "scale": 1.5,
        "hks_poles": 16,
        "hks_error_bound": 1e-6,
        "face_labels": np.digitize(height, [-0.3, 0.3]).astype("i2") if labels == "faces" else None,
        "id": f"mesh{number:03}",
        "source": f"mesh{number:03}.obj",
        "source_sha256": "0" * 64,
        "key": sha256_of(str(number).encode()),
        "label_domain": "face",
        "polygons": len(faces),
    }
    return Sample(**(values | names))


def write_dataset(
    folder: Path,
    samples,
    splits,
    *,
    task="segmentation",
    classes=("low", "middle", "high"),
    recipe=PAPER,
    cuts=(),
    notes=(),
):
    """A folder with one shard and its index; with `cuts`, another shard begins at each of these samples."""
    folder.mkdir(parents=True, exist_ok=True)
    samples = sorted(samples, key=lambda s: s.id)
    entries = []
    for number, (start, end) in enumerate(pairwise((0, *cuts, len(samples)))):
        some = samples[start:end]
        image = shard_image(some, recipe=recipe, algorithm_version=1, classes=classes)
        publish(folder / f"shard-{number}.h5", image)
        entries.append(entry_of(f"shard-{number}.h5", image, sha256_of(image), some))
    index = Index(
        dataset="toy",
        task=task,
        classes=classes,
        recipe=recipe,
        algorithm_version=1,
        shards=tuple(entries),
        ids=tuple(s.id for s in samples),
        keys=tuple(s.key for s in samples),
        splits=tuple(splits),
        split_seed=0,
        val_fraction=0.0,
        notes=notes,
    )
    index.write(folder)
    return folder


def toy_dataset(folder: Path, notes=(), **changes):
    """Eight meshes of different size to train with, three each to validate and test."""
    samples = [sample(number, level=number % 3, **changes) for number in range(14)]
    return write_dataset(folder, samples, ["train"] * 8 + ["val"] * 3 + ["test"] * 3, notes=notes)
