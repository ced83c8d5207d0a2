"""Samples that are computed and not yet packed, one file each: a killed run loses only what was in flight.

A file is a line of JSON, with the plain values and the types and shapes of the arrays, and then the arrays' bytes.
Shards would do, but writing and reading those takes longer than computing a small mesh.
"""

import json
from contextlib import suppress
from dataclasses import fields
from math import prod
from pathlib import Path
from typing import Any

import numpy as np

from meshshard.files import TEMPORARY_PREFIX, publish, sha256_of, sha256_of_file
from meshshard.sample import Sample

FOLDER = ".staging"


def put(folder: Path, sample: Sample) -> str:
    """Store a sample under its key. Returns the name of its file, for `path_of`. The file's sha256 is in the name, so
    that a later run notices damage."""
    values: dict[str, Any] = {field.name: getattr(sample, field.name) for field in fields(sample)}
    arrays = {name: value for name, value in values.items() if isinstance(value, np.ndarray)}
    plain = {name: value for name, value in values.items() if name not in arrays}
    shapes = {name: (array.dtype.str, array.shape) for name, array in arrays.items()}
    header = json.dumps({"plain": plain, "arrays": shapes}).encode() + b"\n"
    content = b"".join((header, *(array.tobytes() for array in arrays.values())))
    # a power cut may take it, and then it is computed again: not worth waiting for the disk
    name = f"{sample.key}.{sha256_of(content)}.sample"
    publish(path_of(folder, name), content, durable=False)
    return name


def path_of(folder: Path, name: str) -> Path:
    """Where a staged sample of that name lies."""
    return folder / FOLDER / name


def staged(folder: Path) -> dict[str, Path]:
    """Key -> file of what an unfinished run left."""
    return {path.name.split(".")[0]: path for path in (folder / FOLDER).glob("[!.]*.sample")}


def get(path: Path) -> Sample:
    """A staged sample; `prepare` looked at it, or it was put since then."""
    content = path.read_bytes()
    end = content.index(b"\n") + 1
    header = json.loads(content[:end])
    arrays: dict[str, Any] = {}
    for name, (dtype, shape) in header["arrays"].items():
        arrays[name] = np.frombuffer(content, dtype=dtype, count=prod(shape), offset=end).reshape(shape)
        end += arrays[name].nbytes
    return Sample(**header["plain"], **arrays)


def clear(folder: Path) -> None:
    """Remove the staging folder, after what it held was published. A worker that was lost may still write: the next
    run removes that."""
    for path in (folder / FOLDER).glob("*"):
        path.unlink(missing_ok=True)
    with suppress(OSError):
        (folder / FOLDER).rmdir()


def prepare(folder: Path) -> None:
    """Make the staging folder; remove from it what killed runs left unfinished, and samples that are damaged."""
    (folder / FOLDER).mkdir(parents=True, exist_ok=True)
    for path in (folder / FOLDER).glob(f"{TEMPORARY_PREFIX}*"):
        path.unlink()
    for path in staged(folder).values():
        if sha256_of_file(path) != path.name.split(".")[1]:
            path.unlink()
