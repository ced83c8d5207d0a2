"""How fast samples are read: random access beside a bare memory map and npz, opening, and the first touch."""

import hashlib
import statistics
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from meshshard.dataset import open_dataset
from meshshard.files import publish, sha256_of
from meshshard.index import Index, ShardEntry
from meshshard.plain import to_json
from meshshard.reader import Shard
from meshshard.recipe import RECIPES
from meshshard.sample import Sample
from meshshard.schema import BY_NAME, PER_FACE, PER_VERTEX
from meshshard.writer import entry_of, shard_image
from meshshard_prep.bench.measure import blob
from meshshard_prep.pipeline import compute_features

ARRAYS = (*(field.name for field in (*PER_VERTEX, *PER_FACE) if field.required), "face_labels")
"""What is read of a sample, each copied, so that every byte of it is touched."""

PAGE = """# Speed of reading

Written by `make bench`: one run, the calls in turn, medians of {rounds} rounds, CPU time of one thread (for opening:
elapsed). {shards} shards of {meshes} meshes of {vertices} vertices, {shard_mb:.0f} MB each, in the page cache.

Processor: {processor}. {versions}.

## A sample, in random order, all its arrays copied

| way | µs | meshshard's time over it |
|---|---|---|
| meshshard: `dataset[number]` | {ours_us:.1f} | 1 |
| numpy.memmap, one for each array | {memmap_us:.1f} | {over_memmap:.2f} |
| the same maps as plain ndarrays | {bare_us:.1f} | {over_bare:.2f} |
| numpy.load of an npz with the same arrays | {npz_us:.0f} | 1 / {npz_over_ours:.0f} |

## Opening

A data set of {many:,} samples in {many_shards} shards, by `open_dataset`, with ids, splits, vertex counts and one
sample: {open_s:.2f} s.

## First touch

sha256 of a shard alone {sha256_gbs:.2f} GB/s; all that happens before its first sample is given (sha256, structure,
every index) {touch_gbs:.2f} GB/s.
"""


def write(folder: Path, figures: dict[str, Any]) -> None:
    """`streaming.json` and `streaming.md` in `folder`."""
    folder.mkdir(parents=True, exist_ok=True)
    publish(folder / "streaming.json", (to_json(figures) + "\n").encode())
    publish(folder / "streaming.md", page(figures).encode())


def page(figures: dict[str, Any]) -> str:
    """The figures as Markdown."""
    ours = figures["ours_us"]
    return PAGE.format(
        **figures | {"versions": ", ".join(f"{name} {version}" for name, version in figures["versions"].items())},
        over_memmap=ours / figures["memmap_us"],
        over_bare=ours / figures["bare_us"],
        npz_over_ours=figures["npz_us"] / ours,
    )


def streaming(*, vertices: int = 752, meshes: int = 256, shards: int = 4, many: int = 100_000) -> dict[str, Any]:
    """All figures, from generated shards in a temporary folder."""
    rounds = 9
    points, faces = blob(vertices)
    first = replace(compute_features(points, faces), face_labels=np.zeros(len(faces), dtype=np.int16))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        entries = _write(folder, first, meshes, shards, many // meshes)
        figures = _random_access(folder, rounds)
        opening, touch, plain = [], [], []
        for _ in range(rounds):
            start = time.perf_counter()
            _open(folder)
            opening.append(time.perf_counter() - start)
            touch.append(_spent(lambda: Shard(folder / entries[0].file, entries[0].sha256)[0]))
            plain.append(_spent(lambda: _sha256(folder / entries[0].file)))
    size = entries[0].bytes / 1e9
    return figures | {
        "rounds": rounds,
        "vertices": vertices,
        "meshes": meshes,
        "shards": shards,
        "shard_mb": 1e3 * size,
        "many": sum(entry.meshes for entry in entries),
        "many_shards": len(entries),
        "open_s": statistics.median(opening),
        "touch_gbs": size / statistics.median(touch),
        "sha256_gbs": size / statistics.median(plain),
    }


def _write(folder: Path, first: Sample, meshes: int, shards: int, many: int) -> list[ShardEntry]:
    """A folder with `shards` shards, and an index that names the last of them again until there are `many`."""
    entries = []
    for number in range(shards):
        samples = [replace(first, id=f"mesh{number:03}-{row:04}", key=f"{row:064}") for row in range(meshes)]
        image = shard_image(samples, recipe=RECIPES["paper"], algorithm_version=1, classes=("all",))
        publish(folder / f"shard-{number}.h5", image)
        entries.append(entry_of(f"shard-{number}.h5", image, sha256_of(image), samples))
    entries += [entries[-1]] * (many - shards)
    size = meshes * len(entries)
    Index(
        dataset="bench",
        task="segmentation",
        classes=("all",),
        recipe=RECIPES["paper"],
        algorithm_version=1,
        shards=tuple(entries),
        ids=tuple(f"mesh{number:03}-{row:04}" for number in range(len(entries)) for row in range(meshes)),
        keys=tuple(f"{row:064}" for _ in entries for row in range(meshes)),
        splits=("train",) * size,
        split_seed=0,
        val_fraction=0.0,
    ).write(folder)
    return entries


def _random_access(folder: Path, rounds: int) -> dict[str, float]:
    """Microseconds a sample: ours, and three other ways."""
    dataset = open_dataset(folder)
    files = sorted(folder.glob("shard-*.h5"))
    meshes = dataset.index.shards[0].meshes
    order = np.random.default_rng(0).permutation(meshes * len(files)).tolist()
    np.savez(folder / "sample.npz", **{name: getattr(dataset[0], name) for name in ARRAYS})
    maps = [_maps(path) for path in files]
    bare = [{name: array.view(np.ndarray) for name, array in arrays.items()} for arrays in maps]
    ptr = [Shard(path).columns for path in files]
    rows = [(columns["vertex_ptr"].tolist(), columns["face_ptr"].tolist()) for columns in ptr]

    def ours() -> None:
        for number in order:
            sample = dataset[number]
            for name in ARRAYS:
                getattr(sample, name).copy()

    def raw(arrays: list[dict[str, np.ndarray]]) -> None:
        for number in order:
            shard, row = divmod(number, meshes)
            vertex_ptr, face_ptr = rows[shard]
            cut = {"V": slice(*vertex_ptr[row : row + 2]), "F": slice(*face_ptr[row : row + 2])}
            for name, array in arrays[shard].items():
                array[cut[AXIS[name]]].copy()

    def npz() -> None:
        for _ in range(50):
            with np.load(folder / "sample.npz") as file:
                for name in ARRAYS:
                    file[name]

    calls: dict[str, tuple[Callable[[], Any], int]] = {
        "ours_us": (ours, len(order)),
        "memmap_us": (lambda: raw(maps), len(order)),
        "bare_us": (lambda: raw(bare), len(order)),
        "npz_us": (npz, 50),
    }
    spent: dict[str, list[float]] = {name: [] for name in calls}
    for _ in range(rounds):
        for name, (call, count) in calls.items():
            spent[name].append(1e6 * _spent(call) / count)
    return {name: statistics.median(times) for name, times in spent.items()}


AXIS = {name: str(BY_NAME[name].axes[0]) for name in ARRAYS}


def _maps(path: Path) -> dict[str, np.ndarray]:
    """A numpy.memmap for each array, as one would write it by hand."""
    with h5py.File(path) as file:
        return {
            name: np.memmap(
                path, file[name].dtype, mode="r", offset=file[name].id.get_offset(), shape=file[name].shape
            )
            for name in ARRAYS
        }


def _open(folder: Path) -> None:
    dataset = open_dataset(folder)
    assert len(dataset.ids) == len(dataset.vertex_counts) == sum(map(len, dataset.splits.values()))
    dataset[0]


def _sha256(path: Path) -> str:
    with path.open("rb", buffering=0) as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def _spent(call: Callable[[], Any]) -> float:
    start = time.process_time()
    call()
    return time.process_time() - start
