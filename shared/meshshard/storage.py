"""Where the fields of a shard lie in its file: plain arrays in the types of the schema, and nothing else."""

import math
import mmap
from io import BytesIO, FileIO

import numpy as np

from meshshard.errors import InvalidShard
from meshshard.hdf5 import Root, read_dataset, read_root
from meshshard.schema import ATTRIBUTES, FIELDS, Field


def stored(stream: FileIO | BytesIO) -> tuple[dict[str, str | int], dict[str, np.ndarray]]:
    """Root attributes and fields of an open shard file, by name. Fields are read-only views of the mapped file,
    strings still padded bytes. InvalidShard for anything format 1 has no use for."""
    size = stream.seek(0, 2)
    if size == 0:
        raise InvalidShard("it is empty")
    # one map for all fields: each map holds a file descriptor, of which a process has a thousand
    mapped = mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ)
    root = read_root(mapped)
    attributes = {name: _attribute(root, name) for name in ATTRIBUTES}
    columns = {}
    for field in FIELDS:
        if field.name in root.links:
            try:
                columns[field.name] = _column(mapped, root.links[field.name], field)
            except InvalidShard as error:
                raise InvalidShard(f"the field {field.name!r}: {error}") from error
        elif field.required:
            raise InvalidShard(f"the field {field.name!r} is missing")
    if sum(column.nbytes for column in columns.values()) > size:
        raise InvalidShard(f"its fields together are larger than its {size} bytes: some lie on top of each other")
    return attributes, columns


def _attribute(root: Root, name: str) -> str | int:
    if name not in root.attributes:
        raise InvalidShard(
            f"the root attribute {name!r} is missing: not a meshshard shard, or one with more than eight attributes, "
            "or with one above 64 KB, which format 1 has no use for"
        )
    kind, value = root.attributes[name]
    if kind == "i8" and len(value) == 8:
        return int.from_bytes(value, "little", signed=True)
    if kind == f"S{len(value)}":
        return value.rstrip(b"\0").decode(errors="backslashreplace")
    raise InvalidShard(f"the root attribute {name!r} is neither a fixed string nor an integer i8, but {kind}")


def _column(mapped: mmap.mmap, address: int | None, field: Field) -> np.ndarray:
    """A view of one field, after its storage was checked."""
    if address is None:
        raise InvalidShard("it is a link that leads elsewhere; format 1 has hard links only")
    found = read_dataset(mapped, address)
    if not (found.kind[0] == "S" if field.dtype == "str" else found.kind == field.dtype):
        raise InvalidShard(f"its type is {found.kind}, format 1 says {field.dtype}")
    if len(found.shape) != len(field.axes):
        raise InvalidShard(f"it has {len(found.shape)} axes, format 1 says {len(field.axes)}")
    if found.offset is None:
        raise InvalidShard("it is not stored in one piece inside the file")
    kind = np.dtype(found.kind).newbyteorder("<")
    count = math.prod(found.shape)
    offset = found.offset if count else 0  # a field of no elements has no place
    if max(found.shape) > len(mapped) or offset + count * kind.itemsize > len(mapped):
        raise InvalidShard(f"its shape {found.shape} reaches beyond the end of the file")
    return np.frombuffer(mapped, dtype=kind, count=count, offset=offset).reshape(found.shape)
