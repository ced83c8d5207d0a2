"""Samples that are computed and not yet packed, one file each: a killed run loses only what was in flight.

A file is a line of JSON, with the plain values and the names of the arrays, and then the arrays in NumPy's .npy
format. Shards would do, but writing and reading those takes longer than computing a small mesh.
"""

import io
import json
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from meshshard.errors import InvalidShard
from meshshard.files import TEMPORARY_PREFIX, publish, sha256_of
from meshshard.sample import Sample

FOLDER = ".staging"


def put(folder: Path, sample: Sample) -> None:
    """Store a sample under its key. Its file's sha256 is in the name, so damage is noticed on the way back."""
    values: dict[str, Any] = {field.name: getattr(sample, field.name) for field in fields(sample)}
    arrays = {name: value for name, value in values.items() if isinstance(value, np.ndarray)}
    plain = {name: value for name, value in values.items() if name not in arrays}
    file = io.BytesIO()
    file.write(json.dumps({"plain": plain, "arrays": list(arrays)}).encode() + b"\n")
    for array in arrays.values():
        np.lib.format.write_array(file, np.ascontiguousarray(array), allow_pickle=False)
    publish(folder / FOLDER / f"{sample.key}.{sha256_of(file.getvalue())}.sample", file.getvalue(), durable=False)


def staged(folder: Path) -> dict[str, Path]:
    """Key -> file of what an unfinished run left."""
    return {path.name.split(".")[0]: path for path in (folder / FOLDER).glob("[!.]*.sample")}


def get(path: Path) -> Sample:
    """A staged sample. InvalidShard: the file was damaged since `prepare` looked."""
    content = path.read_bytes()
    if sha256_of(content) != path.name.split(".")[1]:
        raise InvalidShard(f"{path}: the file is damaged; delete it and run meshshard features again")
    file = io.BytesIO(content)
    header = json.loads(file.readline())
    arrays: dict[str, Any] = {name: np.lib.format.read_array(file, allow_pickle=False) for name in header["arrays"]}
    return Sample(**header["plain"], **arrays)


def clear(folder: Path) -> None:
    """Remove the staging folder, after what it held was published."""
    for path in (folder / FOLDER).glob("*"):
        path.unlink()
    (folder / FOLDER).rmdir()


def prepare(folder: Path) -> None:
    """Make the staging folder; remove from it what killed runs left unfinished, and samples that are damaged."""
    (folder / FOLDER).mkdir(parents=True, exist_ok=True)
    for path in (folder / FOLDER).glob(f"{TEMPORARY_PREFIX}*"):
        path.unlink()
    for path in staged(folder).values():
        try:
            get(path)
        except InvalidShard:
            path.unlink()
