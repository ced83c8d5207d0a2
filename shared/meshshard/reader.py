"""A shard to samples: checked on first touch, then mapped straight from the page cache."""

import json
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from meshshard.errors import InvalidShard
from meshshard.files import sha256_of_file
from meshshard.recipe import Recipe
from meshshard.sample import DIAGNOSTICS, Sample
from meshshard.schema import ATTRIBUTES, FIELDS, FORMAT, FORMAT_VERSION, PER_FACE, PER_MESH, PER_VERTEX, Field


class Shard:
    """One shard file. Opened at the first access, and again in every process it is sent to.

    `sha256`: what the index promises; the file is held against it before anything in it is believed.
    InvalidShard is raised for damage, for what format 1 forbids, and for another format or version.
    Arrays of the samples are read-only views of the mapped file.
    """

    def __init__(self, path: Path, sha256: str | None = None) -> None:
        self.path, self.sha256 = path, sha256
        self._columns: dict[str, np.ndarray] | None = None
        self._attributes: dict[str, Any] = {}

    def __getstate__(self) -> dict[str, Any]:
        return {"path": self.path, "sha256": self.sha256, "_columns": None, "_attributes": {}}

    @property
    def columns(self) -> dict[str, np.ndarray]:
        """Every field of the shard by name, strings decoded."""
        if self._columns is None:
            if self.sha256 is not None and (found := self._hash()) != self.sha256:
                raise InvalidShard(
                    f"{self.path}: the file is damaged: its sha256 is {found}, the index says {self.sha256}; "
                    "delete it and run `meshshard features` again"
                )
            self._attributes, self._columns = _open(self.path)
        return self._columns

    def _hash(self) -> str:
        try:
            return sha256_of_file(self.path)
        except OSError as error:
            raise InvalidShard(
                f"{self.path}: the shard cannot be read: {error.strerror}; run meshshard features again"
            ) from error

    @property
    def recipe(self) -> Recipe:
        """The recipe its features were computed with."""
        self.columns  # noqa: B018  opens the file
        return Recipe.from_json(self._attributes["recipe"])

    @property
    def classes(self) -> tuple[str, ...]:
        """Class names; a label is an index into them."""
        self.columns  # noqa: B018  opens the file
        return tuple(json.loads(self._attributes["classes"]))

    @property
    def algorithm_version(self) -> int:
        """The version of the numerical code that wrote it."""
        self.columns  # noqa: B018  opens the file
        return int(self._attributes["algorithm_version"])

    def __len__(self) -> int:
        return len(self.columns["id"])

    def __getitem__(self, row: int) -> Sample:
        columns = self.columns
        if not 0 <= row < len(self):
            raise IndexError(f"{self.path} holds {len(self)} meshes, number {row} was asked for")
        values: dict[str, Any] = {"times": columns["times"]}
        for fields, pointer in ((PER_VERTEX, "vertex_ptr"), (PER_FACE, "face_ptr")):
            rows = slice(int(columns[pointer][row]), int(columns[pointer][row + 1]))
            values |= {f.name: columns[f.name][rows] for f in fields if f.name in columns}
        for field in PER_MESH:
            if field.name in columns and field.name not in DIAGNOSTICS and field.name != "sample_digest":
                value = columns[field.name][row]
                values[field.name] = value if len(field.axes) > 1 else value.item()
        values["diagnostics"] = {name: int(columns[name][row]) for name in DIAGNOSTICS}
        return Sample(**values)

    def stored_digest(self, row: int) -> str:
        """The digest that the writer stored for a sample; `Sample.digest` computes it anew."""
        return str(self.columns["sample_digest"][row])


def _open(path: Path) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    try:
        with h5py.File(path, "r", libver="latest") as file:
            attributes = _attributes(file, path)
            # one map for all fields: each map holds a file descriptor, of which a process has a thousand
            mapped = np.memmap(path, dtype=np.uint8, mode="r").view(np.ndarray)
            columns = {}
            for field in FIELDS:
                column = _column(file, field, path, mapped)
                if column is not None:
                    columns[field.name] = column
    except (OSError, RuntimeError, KeyError, ValueError) as error:  # what h5py raises on files that are not whole
        raise InvalidShard(f"{path}: this is not a readable HDF5 file: {error}") from error
    _check_shapes(columns, path)
    return attributes, columns


def _attributes(file: h5py.File, path: Path) -> dict[str, Any]:
    values: dict[str, Any] = {}
    for name in ATTRIBUTES:
        if name not in file.attrs:
            raise InvalidShard(f"{path}: the root attribute {name!r} is missing: not a meshshard shard")
        kind = file.attrs.get_id(name).get_type()
        fixed_text = isinstance(kind, h5py.h5t.TypeStringID) and not kind.is_variable_str()
        if not fixed_text and not isinstance(kind, h5py.h5t.TypeIntegerID):
            raise InvalidShard(f"{path}: the root attribute {name!r} is neither a fixed string nor an integer")
        value = file.attrs[name]
        values[name] = value.decode() if fixed_text else int(value)
    if values["format"] != FORMAT:
        raise InvalidShard(f"{path}: the format is {values['format']!r}, not {FORMAT!r}")
    if values["format_version"] != FORMAT_VERSION:
        raise InvalidShard(
            f"{path}: format version {values['format_version']}; this meshshard reads version {FORMAT_VERSION}"
        )
    return values


def _column(file: h5py.File, field: Field, path: Path, mapped: np.ndarray) -> np.ndarray | None:
    """A mapped view of one field, after its storage was checked; None for an optional one that is not there."""
    name = field.name.encode()
    if not file.id.links.exists(name):
        if field.required:
            raise InvalidShard(f"{path}: the field {field.name!r} is missing")
        return None
    if file.id.links.get_info(name).type != h5py.h5l.TYPE_HARD:
        raise InvalidShard(f"{path}: {field.name!r} is a link that leads elsewhere; format 1 has hard links only")
    data = file[field.name]
    if not isinstance(data, h5py.Dataset):
        raise InvalidShard(f"{path}: {field.name!r} is a {type(data).__name__}, not a data set")
    storage = data.id.get_create_plist()
    if storage.get_layout() != h5py.h5d.CONTIGUOUS or storage.get_external_count() > 0:
        raise InvalidShard(f"{path}: {field.name!r} is not stored in one piece inside the file")
    wanted = data.dtype if field.dtype == "str" else field.numpy_dtype
    if data.dtype != wanted or (field.dtype == "str" and data.dtype.kind != "S"):
        raise InvalidShard(f"{path}: {field.name!r} has the type {data.dtype}, format 1 says {field.dtype}")
    if data.size == 0:
        return np.zeros(data.shape, dtype=wanted)
    offset = data.id.get_offset()
    if offset is None or offset + data.nbytes > len(mapped):
        raise InvalidShard(f"{path}: {field.name!r} reaches beyond the end of the file")
    column = mapped[offset : offset + data.nbytes].view(wanted).reshape(data.shape)
    if field.dtype != "str":
        return column
    try:
        return np.array([text.decode() for text in column.tolist()], dtype=str)
    except UnicodeDecodeError as error:
        raise InvalidShard(f"{path}: {field.name!r} is not UTF-8: {error}") from error


def _check_shapes(columns: dict[str, np.ndarray], path: Path) -> None:
    """Axes agree with each other and pointers rise from 0 to the end."""
    sizes: dict[str | int, int] = {"N": len(columns["id"]), "N+1": len(columns["id"]) + 1}
    for axis, pointer in (("V", "vertex_ptr"), ("F", "face_ptr")):
        values = columns[pointer]
        if len(values) == 0 or values[0] != 0 or (np.diff(values) < 0).any():
            raise InvalidShard(f"{path}: {pointer!r} does not rise from 0")
        sizes[axis] = int(values[-1])
    sizes["T"] = len(columns["times"])
    if "eigenvalues" in columns:
        sizes["K"] = columns["eigenvalues"].shape[-1]
    for field in FIELDS:
        if field.name in columns:
            wanted = tuple(sizes.get(axis, axis) for axis in field.axes)
            if columns[field.name].shape != wanted:
                raise InvalidShard(
                    f"{path}: {field.name!r} has the shape {columns[field.name].shape}, its axes "
                    f"{field.axes} say {wanted}"
                )
