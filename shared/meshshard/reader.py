"""A shard to samples: checked on first touch, then mapped straight from the page cache."""

import errno
import hashlib
import json
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from meshshard.errors import InvalidShard, UsageError
from meshshard.files import open_regular
from meshshard.recipe import Recipe
from meshshard.sample import DIAGNOSTICS, Sample
from meshshard.schema import FIELDS, FORMAT, FORMAT_VERSION, PER_FACE, PER_MESH, PER_VERTEX
from meshshard.storage import stored


class Shard:
    """One shard file. Opened at the first access, and again in every process it is sent to.

    `sha256`: what the index promises; the file is held against it before anything in it is believed.
    InvalidShard is raised for damage, for what format 1 forbids, and for another format or version.
    Arrays of the samples are read-only views of the mapped file; indices in them are within their bounds.
    """

    def __init__(self, path: Path, sha256: str | None = None) -> None:
        self.path, self.sha256 = path, sha256
        self._content: _Content | None = None

    def __reduce__(self) -> tuple[Any, ...]:
        return Shard, (self.path, self.sha256)

    @property
    def columns(self) -> dict[str, np.ndarray]:
        """Every field of the shard by name, strings decoded."""
        return self._opened().columns

    @property
    def recipe(self) -> Recipe:
        """The recipe its features were computed with."""
        return self._opened().recipe

    @property
    def classes(self) -> tuple[str, ...]:
        """Class names; a label is an index into them."""
        return self._opened().classes

    @property
    def algorithm_version(self) -> int:
        """The version of the numerical code that wrote it."""
        return self._opened().algorithm_version

    def __len__(self) -> int:
        return len(self._opened().columns["id"])

    def __getitem__(self, row: int) -> Sample:
        content = self._opened()
        if not 0 <= row < len(content.meshes):
            raise IndexError(f"{self.path} holds {len(content.meshes)} meshes, number {row} was asked for")
        values = content.meshes[row].copy()
        values["diagnostics"] = values["diagnostics"].copy()
        for pointer, arrays in content.arrays:
            rows = slice(pointer[row], pointer[row + 1])
            for name, array in arrays:
                values[name] = array[rows]
        return Sample.of_checked(values)

    def stored_digest(self, row: int) -> str:
        """The digest that the writer stored for a sample; `Sample.digest` computes it anew."""
        return str(self.columns["sample_digest"][row])

    def _opened(self) -> "_Content":
        if self._content is None:
            try:
                self._content = self._open()
            except InvalidShard as error:
                raise InvalidShard(f"{self.path}: {error}") from error
            except OSError as error:
                if error.errno in (errno.EMFILE, errno.ENFILE):  # no fault of the shard
                    raise UsageError(f"{self.path}: {error.strerror}; raise the limit: ulimit -n 65536") from error
                raise InvalidShard(f"{self.path}: the shard cannot be read: {error.strerror}; {ADVICE}") from error
        return self._content

    def _open(self) -> "_Content":
        with open_regular(self.path) as stream:
            if self.sha256 is not None:
                found = hashlib.file_digest(stream, "sha256").hexdigest()
                if found != self.sha256:
                    raise InvalidShard(
                        f"the file is damaged: its sha256 is {found}, the index says {self.sha256}; "
                        "delete it and run `meshshard features` again"
                    )
            attributes, columns = stored(stream)
        return _checked(attributes, columns)


ADVICE = "open the data set again if it was computed anew, else run meshshard features again"


@dataclass(frozen=True, kw_only=True)
class _Content:
    """An open shard. What samples are made of is laid out once, so that making one costs next to nothing:
    `meshes` are the values of each that are not cut out of long arrays, from the first sample on that is asked for;
    `arrays` are those, with their pointers."""

    columns: dict[str, np.ndarray]
    recipe: Recipe
    classes: tuple[str, ...]
    algorithm_version: int
    arrays: list[tuple[list[int], list[tuple[str, np.ndarray]]]]

    @cached_property
    def meshes(self) -> list[dict[str, Any]]:
        return _meshes(self.columns)


def _checked(attributes: dict[str, Any], columns: dict[str, np.ndarray]) -> _Content:
    if attributes["format"] != FORMAT:
        raise InvalidShard(f"the format is {attributes['format']!r}, not {FORMAT!r}")
    if attributes["format_version"] != FORMAT_VERSION:
        raise InvalidShard(
            f"format version {attributes['format_version']}; this meshshard reads version {FORMAT_VERSION}"
        )
    if not isinstance(attributes["algorithm_version"], int):
        raise InvalidShard("the root attribute 'algorithm_version' is no integer")
    try:
        recipe, classes = Recipe.from_json(attributes["recipe"]), json.loads(attributes["classes"])
    except (UsageError, ValueError, TypeError, OverflowError, RecursionError) as error:
        raise InvalidShard(f"the root attributes 'recipe' and 'classes' are not what JSON says: {error}") from error
    if not isinstance(classes, list) or not all(isinstance(name, str) for name in classes):
        raise InvalidShard(f"the root attribute 'classes' is no list of names: {attributes['classes'][:80]}")
    _check_shapes(columns)
    if columns["times"].tolist() != list(recipe.times):
        raise InvalidShard(f"'times' is {columns['times'].tolist()}, its recipe says {list(recipe.times)}")
    _check_numbers(columns, len(classes))
    if recipe.changes_mesh and "vertex_source" not in columns:
        raise InvalidShard("'vertex_source' is missing, and the recipe has steps or simplify")
    columns |= {field.name: _decoded(columns[field.name], field.name) for field in FIELDS if field.dtype == "str"}
    if odd := set(columns["label_domain"].tolist()) - {"", "face", "edge", "vertex", "mesh"}:
        raise InvalidShard(f"'label_domain' is {odd.pop()!r}")
    if any(first >= second for first, second in pairwise(columns["id"].tolist())):
        raise InvalidShard("its meshes are not sorted by 'id', each once")
    return _Content(
        columns=columns,
        recipe=recipe,
        classes=tuple(classes),
        algorithm_version=attributes["algorithm_version"],
        arrays=[
            (columns[pointer].tolist(), [(f.name, columns[f.name]) for f in fields if f.name in columns])
            for fields, pointer in ((PER_VERTEX, "vertex_ptr"), (PER_FACE, "face_ptr"))
        ],
    )


def _meshes(columns: dict[str, np.ndarray]) -> list[dict[str, Any]]:
    """Of every mesh: what Sample takes and is not cut out of the arrays of V and F."""
    names = [f.name for f in PER_MESH if f.name in columns and f.name not in (*DIAGNOSTICS, "sample_digest")]
    # rows of arrays stay numpy's, single values become Python's
    values = [list(columns[name]) if columns[name].ndim > 1 else columns[name].tolist() for name in names]
    counts = [columns[name].tolist() for name in DIAGNOSTICS]
    return [
        {
            **dict(zip(names, row, strict=True)),
            "times": columns["times"],
            "diagnostics": dict(zip(DIAGNOSTICS, some, strict=True)),
        }
        for row, some in zip(zip(*values, strict=True), zip(*counts, strict=True), strict=True)
    ]


def _decoded(column: np.ndarray, name: str) -> np.ndarray:
    try:
        texts = [text.decode() for text in column.tolist()]
    except UnicodeDecodeError as error:
        raise InvalidShard(f"{name!r} is not UTF-8: {error}") from error
    if any("\0" in text for text in texts):
        raise InvalidShard(f"{name!r} has a zero inside a string")
    return np.array(texts, dtype=str)


def _check_shapes(columns: dict[str, np.ndarray]) -> None:
    """Axes agree with each other and pointers rise from 0 to the end."""
    sizes: dict[str | int, int] = {"N": len(columns["id"]), "N+1": len(columns["id"]) + 1}
    for axis, pointer in (("V", "vertex_ptr"), ("F", "face_ptr")):
        values = columns[pointer]
        if len(values) == 0 or values[0] != 0 or (values[1:] < values[:-1]).any():
            raise InvalidShard(f"{pointer!r} does not rise from 0")
        sizes[axis] = int(values[-1])
    sizes["T"] = len(columns["times"])
    if "eigenvalues" in columns:
        sizes["K"] = columns["eigenvalues"].shape[-1]
    if "correspondence" in columns:
        sizes["M"] = columns["correspondence"].shape[-1]
    for field in FIELDS:
        if field.name in columns:
            wanted = tuple(sizes.get(axis, axis) for axis in field.axes)
            if columns[field.name].shape != wanted:
                raise InvalidShard(
                    f"{field.name!r} has the shape {columns[field.name].shape}, its axes {field.axes} say {wanted}"
                )


def _check_numbers(columns: dict[str, np.ndarray], classes: int) -> None:
    """Every index names something that is there, for compiled code follows it unasked; small fields are finite."""
    vertices, faces = np.diff(columns["vertex_ptr"]), np.diff(columns["face_ptr"])
    with_faces = np.flatnonzero(faces)
    corners = 3 * columns["face_ptr"][with_faces]
    for name, least, limits in (("faces", 0, vertices), ("face_adjacency", -1, faces)):
        largest = np.maximum.reduceat(columns[name].ravel(), corners)  # of each mesh
        if columns[name].min(initial=0) < least or (largest >= limits[with_faces]).any():
            raise InvalidShard(f"{name!r} has an index outside its mesh")
    polygons = columns["polygons"][with_faces]
    # each gives a triangle at least, and steps count those that they take away
    triangles = np.maximum(faces, columns["faces_before"]) + columns["dropped_faces"]
    if (columns["polygons"] > triangles).any():
        raise InvalidShard("'polygons' is more than the triangles there were")
    largest = np.maximum.reduceat(columns["face_source"], columns["face_ptr"][with_faces])
    if columns["face_source"].min(initial=0) < 0 or (largest >= polygons).any():
        raise InvalidShard("'face_source' has a polygon that the mesh file does not have")
    if "vertex_source" in columns and columns["vertex_source"].min(initial=0) < 0:
        raise InvalidShard("'vertex_source' has a negative number")
    matched = columns.get("correspondence")
    if matched is not None and not ((matched >= -1) & (matched < vertices[:, None])).all():
        raise InvalidShard("'correspondence' has an index outside its mesh")
    for name in ("face_labels", "vertex_labels", "mesh_label"):
        labels = columns.get(name)
        if labels is not None and not -1 <= labels.min(initial=0) <= labels.max(initial=-1) < classes:
            raise InvalidShard(f"{name!r} has a label outside -1..{classes - 1}")
    for name in ("centre", "scale", "hks_error_bound"):
        if not np.isfinite(columns[name]).all():
            raise InvalidShard(f"{name!r} has a number that is not finite")
    if (columns["scale"] <= 0).any():
        raise InvalidShard("'scale' has a number that is not above 0")
