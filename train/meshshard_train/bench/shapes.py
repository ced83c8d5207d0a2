"""A data set to measure with: generated meshes, their shards, and the OBJ files that the peer reads again."""

from pathlib import Path

import numpy as np
from jaxtyping import Float64, Int64

from meshshard.dataset import Dataset, open_dataset
from meshshard.files import publish, sha256_of
from meshshard.index import Index
from meshshard.recipe import RECIPES
from meshshard.sample import Sample
from meshshard.writer import entry_of, shard_image

RINGS, AROUND = 25, 30
CLASSES = tuple(f"band{number}" for number in range(8))
RECIPE = RECIPES["paper"]


def ball(seed: int) -> tuple[Float64[np.ndarray, "V 3"], Int64[np.ndarray, "F 3"]]:
    """A closed surface with bumps, 752 vertices and 1500 faces in a drawn order, wound outward."""
    rng = np.random.default_rng(seed)
    down, round_ = np.meshgrid(
        np.pi * np.arange(1, RINGS + 1) / (RINGS + 1), 2 * np.pi * np.arange(AROUND) / AROUND, indexing="ij"
    )
    rings = np.stack([np.sin(down) * np.cos(round_), np.sin(down) * np.sin(round_), np.cos(down)], axis=-1)
    points = np.concatenate([rings.reshape(-1, 3), [[0, 0, 1], [0, 0, -1]]])
    here = np.arange(RINGS * AROUND).reshape(RINGS, AROUND)
    east = np.roll(here, -1, axis=1)
    top, bottom = np.full(AROUND, len(points) - 2), np.full(AROUND, len(points) - 1)
    corners = [
        (here[:-1], here[1:], east[1:]),
        (here[:-1], east[1:], east[:-1]),
        (top, here[0], east[0]),
        (bottom, east[-1], here[-1]),
    ]
    faces = np.concatenate([np.stack(three, axis=-1).reshape(-1, 3) for three in corners])
    points = points * rng.uniform(0.8, 1, (len(points), 1))
    order = rng.permutation(len(points))
    return points[order], np.argsort(order)[rng.permutation(faces)]


def sample(seed: int) -> Sample:
    """`ball` with random features in the range of real ones, labelled by height. No face knows its neighbours."""
    rng = np.random.default_rng(seed)
    vertices, faces = ball(seed)
    size, height = len(vertices), vertices[faces].mean(axis=1)[:, 2]
    return Sample(
        vertices=vertices.astype(np.float32),
        vertex_normals=(vertices / np.linalg.norm(vertices, axis=1, keepdims=True)).astype(np.float32),
        dihedral=rng.random(size, dtype=np.float32),
        hks=rng.uniform(0.5, 30, (size, len(RECIPE.times))).astype(np.float32),
        vertex_areas=np.full(size, 4 * np.pi / size, dtype=np.float32),
        faces=faces.astype(np.int32),
        face_adjacency=np.full(faces.shape, -1, dtype=np.int32),
        face_source=np.arange(len(faces), dtype=np.int32),
        times=np.array(RECIPE.times),
        centre=np.zeros(3),
        scale=1.0,
        hks_poles=16,
        hks_error_bound=1e-6,
        face_labels=np.digitize(height, np.linspace(-0.75, 0.75, len(CLASSES) - 1)).astype(np.int16),
        id=f"ball{seed:05}",
        source=f"ball{seed:05}.obj",
        source_sha256="0" * 64,
        key=f"{seed:064}",
        label_domain="face",
        polygons=len(faces),
    )


def write_shards(folder: Path, meshes: int) -> Dataset:
    """A data set of one shard, all of it for training."""
    samples = [sample(seed) for seed in range(meshes)]
    image = shard_image(samples, recipe=RECIPE, algorithm_version=1, classes=CLASSES)
    publish(folder / "shard.h5", image)
    entry = entry_of("shard.h5", image, sha256_of(image), samples)
    Index(
        dataset="balls",
        task="segmentation",
        classes=CLASSES,
        recipe=RECIPE,
        algorithm_version=1,
        shards=(entry,),
        ids=tuple(one.id for one in samples),
        keys=tuple(one.key for one in samples),
        splits=("train",) * meshes,
        split_seed=0,
        val_fraction=0.0,
    ).write(folder)
    return open_dataset(folder)


def write_obj(folder: Path, mesh: Sample) -> Path:
    """The mesh as an OBJ file."""
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in mesh.vertices.tolist()]
    lines += [f"f {a} {b} {c}" for a, b, c in (mesh.faces + 1).tolist()]
    path = folder / mesh.source
    path.write_text("\n".join(lines))
    return path
