"""Writes the archived data sets `full` and `plain` and `expected.json` beside this file. See README.md."""

import hashlib
import json
import sys
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parents[1]))

from samples import PAPER, write_dataset  # noqa: E402
from shapes import sphere, tetrahedron  # noqa: E402

from meshshard_prep import compute_features  # noqa: E402

EXTRAS = {name: True for name in ("geodesic", "shape_diameter", "signed_dihedral", "official_dihedral")}
FULL = replace(PAPER, name="full", spectrum=5, **EXTRAS)
SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 0, 0], [1, 1, 0], [0, 1, 0], [7, 7, 7]], dtype=float)


def named(sample, name, split, **changes):
    """The sample with the names a run would give it."""
    hashes = {key: hashlib.sha256(f"{key} {name}".encode()).hexdigest() for key in ("source_sha256", "key")}
    return replace(sample, id=name, source=f"{name}.obj", split=split, **hashes, **changes)


def full():
    """Three meshes that have every field."""
    meshes = {
        "closed/octahedron": (sphere(0), "train", 0),
        "closed/tetrahedron": ((2 * tetrahedron()[0] + [10, 20, 30], tetrahedron()[1]), "val", 1),
        "open/größe": ((SQUARE, np.array([[0, 1, 2], [3, 4, 5], [0, 1, 3]])), "test", 2),
    }
    for name, ((vertices, faces), split, label) in meshes.items():
        yield named(
            compute_features(vertices, faces, FULL),
            name,
            split,
            group=name.split("/")[0],
            label_domain="face",
            mesh_label=label,
            face_labels=(np.arange(len(faces)) % 4 - 1).astype("i2"),
            vertex_labels=(np.arange(len(vertices)) % 3).astype("i2"),
            vertex_source=np.arange(len(vertices), dtype="i4")[::-1].copy(),
            correspondence=np.array([3, -1, 0], dtype="i4"),
            label_rule="kept",
        )


def plain():
    """Two meshes that have only what every mesh has."""
    yield named(compute_features(*sphere(1)), "sphere", "")
    yield named(compute_features(*tetrahedron()), "tetrahedron", "")


def found_by_h5py(path):
    """Field -> its strings, or its type, shape and the sha256 of its bytes."""
    with h5py.File(path) as shard:
        found = {}
        for name, data in shard.items():
            if data.dtype.kind == "S":
                found[name] = [text.decode() for text in data[:]]
            else:
                digest = hashlib.sha256(data[:].tobytes()).hexdigest()
                found[name] = {"type": data.dtype.str, "shape": data.shape, "sha256": digest}
        return found


if __name__ == "__main__":
    write_dataset(HERE / "full", full(), ["train", "val", "test"], classes=("eins", "zwei", "größe"), recipe=FULL)
    write_dataset(HERE / "plain", plain(), ["", ""], task="unlabelled", classes=())
    expected = {name: found_by_h5py(HERE / name / "shard-0.h5") for name in ("full", "plain")}
    (HERE / "expected.json").write_text(json.dumps(expected, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
