"""Deformed copies of one shape, vertices renumbered, with the correspondence that is then known."""

from dataclasses import replace

import numpy as np
from samples import PAPER, write_dataset
from shapes import sphere

from meshshard_prep import compute_features


def body(level=2):
    """A lumpy ball without symmetry."""
    vertices, faces = sphere(level)
    lumps = np.array([[0, 1, 0], [1, -0.2, 0.3], [-1, -0.3, 0.1], [0.3, -1, 0.6]])
    lumps /= np.linalg.norm(lumps, axis=1, keepdims=True)
    return vertices * (1 + np.exp(6 * (vertices @ lumps.T - 1)) @ [0.9, 1.1, 0.8, 1.3])[:, None], faces


def deformed(number, level=2):
    """Vertices and faces of a twisted and bent body, and its vertex at each vertex of the body."""
    rng = np.random.default_rng(number)
    vertices, faces = body(level)
    twist, bend = rng.uniform(-0.4, 0.4, 2) * (number > 0)
    x, y, z = vertices.T
    x, z = np.cos(twist * y) * x - np.sin(twist * y) * z, np.sin(twist * y) * x + np.cos(twist * y) * z
    x, y = np.cos(bend * y) * x - np.sin(bend * y) * y, np.sin(bend * y) * x + np.cos(bend * y) * y
    order = rng.permutation(len(vertices))
    place = np.argsort(order)
    return np.stack([x, y, z], axis=1)[order], place[faces], place


def matched_sample(number, *, level=2, spectrum=10, **changes):
    """Its features, with eigenpairs and correspondence."""
    vertices, faces, place = deformed(number, level)
    sample = compute_features(vertices, faces, replace(PAPER, spectrum=spectrum))
    names = {"id": f"mesh{number:03}", "source": f"mesh{number:03}.obj", "key": f"{number:064}"}
    return replace(sample, **({"correspondence": place.astype("i4"), "source_sha256": "0" * 64} | names | changes))


def matched_dataset(folder, *, spectrum=10, splits=("train",) * 3 + ("val",) * 2 + ("test",) * 2):
    """Shards of such meshes."""
    samples = [matched_sample(number, level=1 + number % 2, spectrum=spectrum) for number in range(len(splits))]
    few = min(
        len(sample.correspondence) for sample in samples
    )  # the finer body begins with the vertices of the coarser
    samples = [replace(sample, correspondence=sample.correspondence[:few]) for sample in samples]
    return write_dataset(
        folder, samples, splits, task="correspondence", classes=(), recipe=replace(PAPER, spectrum=spectrum)
    )
