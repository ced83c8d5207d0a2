"""Samples to the bytes of one shard. The same samples give the same bytes, always."""

import json
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import h5py
import numpy as np

from meshshard.index import ShardEntry
from meshshard.recipe import Recipe
from meshshard.sample import DIAGNOSTICS, Sample
from meshshard.schema import FIELDS, FORMAT, FORMAT_VERSION, Field


def shard_image(
    samples: Sequence[Sample], *, recipe: Recipe, algorithm_version: int, classes: Sequence[str]
) -> bytes:
    """The HDF5 file that holds `samples`, sorted by id, as bytes; nothing touches the disk.

    ValueError: no samples, two with one id, or optional fields (labels, say) that some have and others lack.
    """
    if not samples:
        raise ValueError("a shard holds at least one sample")
    ordered = sorted(samples, key=lambda s: s.id)
    for first, second in pairwise(ordered):
        if first.id == second.id:
            raise ValueError(f"two samples are called {first.id!r}")
    # In memory, because a file that is open for writing when its process dies cannot be opened again.
    with h5py.File("image", "w", driver="core", backing_store=False, libver="latest", track_order=False) as file:
        file.attrs["format"] = np.bytes_(FORMAT)
        file.attrs["format_version"] = np.int64(FORMAT_VERSION)
        file.attrs["recipe"] = np.bytes_(recipe.to_json())
        file.attrs["algorithm_version"] = np.int64(algorithm_version)
        file.attrs["classes"] = np.bytes_(json.dumps(list(classes), ensure_ascii=True))
        for field in FIELDS:
            column = _column(field, ordered)
            if column is not None:
                # track_times off: a date in the file would make its bytes depend on the clock
                file.create_dataset(field.name, data=column, dtype=column.dtype, track_times=False)
        file.flush()
        return bytes(file.id.get_file_image())


def entry_of(file: str, image: bytes, sha256: str, samples: Sequence[Sample]) -> ShardEntry:
    """What the index says of a shard file: of this name, with this content and its hash, of these samples."""
    return ShardEntry(
        file=file,
        bytes=len(image),
        sha256=sha256,
        vertex_counts=tuple(len(sample.vertices) for sample in samples),
        faces=sum(len(sample.faces) for sample in samples),
    )


def _column(field: Field, samples: Sequence[Sample]) -> np.ndarray | None:
    """All samples' values of one field, concatenated; None for an optional field that none has."""
    if field.name in ("vertex_ptr", "face_ptr"):
        counts = [len(s.vertices if field.name == "vertex_ptr" else s.faces) for s in samples]
        return np.concatenate([[0], np.cumsum(counts)]).astype(field.numpy_dtype)
    if field.name == "times":
        if any(not np.array_equal(s.times, samples[0].times) for s in samples):
            raise ValueError("the samples of a shard have the same times")
        return samples[0].times.astype(field.numpy_dtype)
    values: list[Any]
    if field.name == "sample_digest":
        values = [s.digest for s in samples]
    elif field.name in DIAGNOSTICS:
        values = [s.diagnostics[field.name] for s in samples]
    else:
        values = [getattr(s, field.name) for s in samples]
    missing = [s.id for s, value in zip(samples, values, strict=True) if value is None]
    if missing:
        if len(missing) < len(samples):
            raise ValueError(f"{missing[0]!r} has no {field.name} and other samples of the shard do")
        return None
    if field.dtype == "str":
        encoded = [value.encode() for value in values]
        return np.array(encoded, dtype=h5py.string_dtype("utf-8", max(1, *map(len, encoded))))
    stacked = np.stack(values) if field.axes[0] == "N" else np.concatenate(values)
    if stacked.dtype.kind != field.numpy_dtype.kind:
        raise ValueError(f"{field.name} is stored as {field.dtype}, and {stacked.dtype} came")
    return stacked.astype(field.numpy_dtype, casting="same_kind")
