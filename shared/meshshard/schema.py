"""The shard format, version 1, as one table. Writer, reader, validator and docs/format.md all follow it."""

from dataclasses import dataclass

import numpy as np

from meshshard.sample import DIAGNOSTICS

FORMAT = "meshshard"
FORMAT_VERSION = 1


@dataclass(frozen=True)
class Field:
    """One data set of a shard.

    `axes`: V vertices and F faces of all meshes, N meshes, N+1 pointers, T times, K eigenpairs,
    M vertices of a template, or a number.
    `dtype`: a little-endian numpy type, or "str" for fixed-length UTF-8 padded with zeros.
    """

    name: str
    axes: tuple[str | int, ...]
    dtype: str
    unit: str
    meaning: str
    required: bool = True

    @property
    def numpy_dtype(self) -> np.dtype:
        """The exact numpy type of a numeric field."""
        return np.dtype(self.dtype).newbyteorder("<")


FIELDS = (
    Field("vertex_ptr", ("N+1",), "i8", "1", "mesh i has the vertices vertex_ptr[i] to vertex_ptr[i+1]"),
    Field("face_ptr", ("N+1",), "i8", "1", "mesh i has the faces face_ptr[i] to face_ptr[i+1]"),
    Field(
        "vertices",
        ("V", 3),
        "f4",
        "radius",
        "positions, (original - centre) / scale: referenced vertices have mean 0, radius 1",
    ),
    Field("vertex_normals", ("V", 3), "f4", "1", "unit normals, angle-weighted; 0 where undefined"),
    Field("dihedral", ("V",), "f4", "radian", "mean turning angle of the interior edges; flat 0, folded shut pi"),
    Field("hks", ("V", "T"), "f4", "1/radius^2", "heat kernel signature at `times`; 0 at unreferenced vertices"),
    Field("vertex_areas", ("V",), "f4", "radius^2", "barycentric lumped areas; they sum to the surface area"),
    Field("dihedral_signed", ("V",), "f4", "radian", "mean signed turning angle; convex positive", required=False),
    Field("dihedral_official", ("V", 3), "f4", "1", "the published code's three channels", required=False),
    Field(
        "geodesic",
        ("V", 10),
        "f4",
        "area^(1/2), 1",
        "mean and largest geodesic distance; areas of geodesic discs over flat ones; 0 at unreferenced vertices",
        required=False,
    ),
    Field(
        "shape_diameter",
        ("V", 2),
        "f4",
        "area^(1/2)",
        "median and fifth of the lengths of rays to the opposite side; 0 at unreferenced vertices",
        required=False,
    ),
    Field(
        "eigenvectors",
        ("V", "K"),
        "f4",
        "1/radius",
        "of the Laplacian, mass-orthonormal; 0 at unreferenced vertices",
        required=False,
    ),
    Field("vertex_labels", ("V",), "i2", "class", "0-based class, -1 unlabelled", required=False),
    Field(
        "vertex_source",
        ("V",),
        "i4",
        "1",
        "vertex of the mesh file it is, or lies nearest to; there where the recipe has steps",
        required=False,
    ),
    Field("faces", ("F", 3), "i4", "1", "corners, indices into the mesh's own vertices, file order"),
    Field(
        "face_adjacency",
        ("F", 3),
        "i4",
        "1",
        "face across the edges (0,1), (1,2), (2,0); -1 if not exactly one",
    ),
    Field("face_source", ("F",), "i4", "1", "polygon of the mesh file it was cut from; simplified: lies nearest to"),
    Field("face_labels", ("F",), "i2", "class", "0-based class, -1 unlabelled", required=False),
    Field("times", ("T",), "f8", "radius^2", "diffusion times of `hks`"),
    Field("id", ("N",), "str", "", "unique name in the data set; meshes are sorted by it"),
    Field("source", ("N",), "str", "", "mesh file, relative to the raw folder"),
    Field("source_sha256", ("N",), "str", "", "of the mesh file's bytes, hexadecimal"),
    Field("key", ("N",), "str", "", "sha256 of content, labels, recipe and algorithm version: the cache key"),
    Field("sample_digest", ("N",), "str", "", "sha256 of the mesh's arrays"),
    Field("split", ("N",), "str", "", "as shipped: train, val, test, or empty"),
    Field("group", ("N",), "str", "", "meshes of one subject or sequence share it; empty: none known"),
    Field("label_domain", ("N",), "str", "", "what the label file counts: face, edge, vertex, mesh, or empty"),
    Field("label_rule", ("N",), "str", "", "how its labels became those stored; empty: they are the file's"),
    Field("mesh_label", ("N",), "i4", "class", "class of the whole mesh, -1 none"),
    Field("centre", ("N", 3), "f8", "file unit", "vertex mean that was subtracted"),
    Field("scale", ("N",), "f8", "file unit", "maximum radius that was divided by"),
    Field(
        "eigenvalues",
        ("N", "K"),
        "f8",
        "1/radius^2",
        "the K lowest, rising; NaN where a mesh has fewer",
        required=False,
    ),
    Field("hks_poles", ("N",), "i4", "1", "poles of the rational sum that hks was computed with"),
    Field(
        "hks_error_bound",
        ("N",),
        "f8",
        "1",
        "bound of the relative error of hks: of the method, of measured rounding, of storage",
    ),
    Field("polygons", ("N",), "i4", "1", "faces of the mesh file"),
    Field(
        "correspondence",
        ("N", "M"),
        "i4",
        "1",
        "vertex of the mesh at each vertex of the template; -1 none",
        required=False,
    ),
    *(Field(name, ("N",), "i4", "1", meaning) for name, meaning in DIAGNOSTICS.items()),
)
"""Every data set of a shard, in the order in which it is written."""

ATTRIBUTES = {
    "format": f"always {FORMAT!r}",
    "format_version": f"an integer, {FORMAT_VERSION}",
    "recipe": "JSON: every setting the features were computed with",
    "algorithm_version": "an integer, raised whenever the same input and recipe give other numbers",
    "classes": "JSON: list of class names; a label is an index into it",
}
"""Root attributes of a shard and their meaning."""

BY_NAME = {f.name: f for f in FIELDS}
PER_VERTEX = tuple(f for f in FIELDS if f.axes[0] == "V")
PER_FACE = tuple(f for f in FIELDS if f.axes[0] == "F")
PER_MESH = tuple(f for f in FIELDS if f.axes[0] == "N")
