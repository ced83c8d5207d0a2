"""A coloured binary PLY for each mesh, where its file had it: by class, or by a feature of its vertices."""

from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Float, Int

from meshshard.dataset import Dataset
from meshshard.errors import UsageError
from meshshard.export import Exporter
from meshshard.palette import colours_between, colours_of
from meshshard.sample import Sample
from meshshard.schema import PER_VERTEX

LABEL = "label"
FEATURES = tuple(f.name for f in PER_VERTEX if f.dtype == "f4")
TYPES = {"f8": "double", "f4": "float", "i4": "int", "i2": "short", "u1": "uchar"}
"""numpy's type -> PLY's."""


def exporter(dataset: Dataset, colour: str | None = None) -> Exporter:
    """The format `ply`. `colour`: "label", a feature of vertices as "dihedral", or a column of one as "hks:3"; labels
    where there are some, "dihedral" elsewhere, if not given.

    UsageError: no labels, or no such feature or column.
    """
    labels = dataset.task == "segmentation"
    chosen = colour or (LABEL if labels else "dihedral")
    if chosen == LABEL and not labels:
        raise UsageError(
            f"{dataset.folder} has no labels of faces or vertices; try --colour dihedral or --colour hks:0"
        )
    if chosen == LABEL:
        return Exporter(".ply", lambda sample: labelled(sample, dataset.index.colours))
    if len(dataset):
        feature_of(dataset[0], chosen)
    return Exporter(".ply", lambda sample: by_feature(sample, chosen))


def labelled(sample: Sample, colours: Sequence[str] = ()) -> bytes:
    """Coloured by the class of faces, or of vertices where those are labelled; -1 in `label` is unlabelled.
    `colours`: hexadecimal, of a data set that has its own."""
    if sample.face_labels is None and sample.vertex_labels is not None:
        return ply_bytes(sample, vertex=of_classes(sample.vertex_labels, colours))
    labels = np.full(len(sample.faces), -1) if sample.face_labels is None else sample.face_labels
    return ply_bytes(sample, face=of_classes(labels, colours))


def by_feature(sample: Sample, name: str) -> bytes:
    """Vertices coloured by a feature, from its least to its greatest value in the mesh, which a comment tells; the
    value itself is the property `quality`."""
    values = feature_of(sample, name)
    known = values[sample.used_vertices]
    lowest, highest = float(known.min()), float(known.max())
    colours = _rgb(colours_between(values.astype(np.float64), lowest, highest))
    return ply_bytes(sample, vertex=colours | {"quality": values}, comment=f"colours: {name}, {lowest} to {highest}")


def feature_of(sample: Sample, name: str) -> Float[np.ndarray, " V"]:
    """A feature of the vertices by its name, or a column of one as "hks:3". UsageError where there is none."""
    field, _, column = name.partition(":")
    found = getattr(sample, field) if field in FEATURES else None
    if found is None:
        there = [name for name in FEATURES if getattr(sample, name) is not None]
        raise UsageError(f"--colour {name}: meshes have {', '.join([LABEL, *there])}; name one, a column as hks:3")
    columns = dict(zip(map(str, range(found.size)), found.reshape(len(found), -1).T, strict=False))
    if column not in columns and (column or len(columns) > 1):
        raise UsageError(f"--colour {name}: {field} has the columns 0 to {len(columns) - 1}; try --colour {field}:0")
    return columns[column or "0"]


def ply_bytes(
    sample: Sample,
    *,
    vertex: Mapping[str, np.ndarray] | None = None,
    face: Mapping[str, np.ndarray] | None = None,
    comment: str = "",
) -> bytes:
    """The mesh in the unit and place of its file, with further properties of vertices and of faces, as binary PLY."""
    places = dict(zip("xyz", sample.original_vertices.T, strict=True))
    corners = {"size": np.full(len(sample.faces), 3, dtype="u1"), "corners": sample.faces}
    points, triangles = _records(places | dict(vertex or {})), _records(corners | dict(face or {}))
    lines = ["ply", "format binary_little_endian 1.0", *([f"comment {comment}"] if comment else [])]
    lines += [f"element vertex {len(points)}", *_properties(points)]
    lines += [f"element face {len(triangles)}", "property list uchar int vertex_indices", *_properties(triangles)[2:]]
    return "\n".join([*lines, "end_header\n"]).encode() + points.tobytes() + triangles.tobytes()


def _records(columns: Mapping[str, np.ndarray]) -> np.ndarray:
    kinds = [(name, values.dtype.newbyteorder("<"), values.shape[1:]) for name, values in columns.items()]
    records = np.empty(len(next(iter(columns.values()))), dtype=kinds)
    for name, values in columns.items():
        records[name] = values
    return records


def _properties(records: np.ndarray) -> list[str]:
    return [f"property {TYPES[records.dtype[name].base.str[1:]]} {name}" for name in records.dtype.names or ()]


def of_classes(labels: Int[np.ndarray, " n"], colours: Sequence[str]) -> dict[str, np.ndarray]:
    """Properties of faces or vertices for `ply_bytes`: the colour of each class, and the class itself as `label`.
    `colours`: as for `labelled`."""
    return _rgb(colours_of(labels, colours)) | {"label": labels.astype("<i2")}


def _rgb(colours: np.ndarray) -> dict[str, np.ndarray]:
    return dict(zip(("red", "green", "blue"), colours.T, strict=True))
