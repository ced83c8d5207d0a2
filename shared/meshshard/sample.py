"""One mesh with its features: what preparing makes, shards store and training reads."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from jaxtyping import Bool, Float32, Float64, Int16, Int32

DIAGNOSTICS = {
    "unreferenced_vertices": "vertices that no kept face uses; their features are 0",
    "welded_vertices": "vertices merged into another one at the same point, on the working copy",
    "degenerate_faces": "faces with a repeated corner (after welding), left out of the working copy",
    "zero_area_faces": "faces with three different corners and no area",
    "boundary_edges": "edges with one face",
    "nonmanifold_edges": "edges with three faces or more",
    "components": "connected pieces (faces that share a vertex)",
    "bridges": "links between pieces, with recipe components = bridged",
    "raised_areas": "vertices with next to no area, for the Laplacian raised to a millionth of equilateral faces'",
    "cut_clusters": "1 where the last eigenvalue stored equals the next one (to 1e-6), 0 elsewhere",
    "undefined_normals": "vertices whose normal is 0: unreferenced, or faces that cancel or have no area",
    "merged_vertices": "vertices merged into another one at the same point, by the step weld",
    "dropped_faces": "faces left out by the step largest_component",
    "turned_faces": "faces whose corners were reversed by the step orient",
    "faces_before": "triangles that the step simplify was given; 0 without it",
    "ambiguous_faces": "simplified faces that lie on two labels or more of the mesh file",
    "unlabelled": "faces (or vertices, where those are labelled) with label -1 in a labelled mesh",
}
"""Name -> meaning of the counts that every sample carries. Nothing is repaired without one of them."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Sample:
    """A mesh in file order with its features. V vertices, F triangles, T diffusion times.

    * vertices: normalised positions, (original - centre) / scale.
    * vertex_normals: unit, angle-weighted; 0 where undefined.
    * dihedral: mean turning angle over a vertex's interior edges, radians; flat 0, folded shut pi.
    * hks: heat kernel signature at `times`, unscaled; 0 at unreferenced vertices.
    * dihedral_signed: the same with signs, convex positive; dihedral_official: the published code's three channels.
    * geodesic: mean and largest distance along the surface, and areas of eight geodesic discs over flat ones.
    * shape_diameter: median, and fifth, of the lengths of rays to the opposite side.
    * eigenvalues, eigenvectors: the K lowest, mass-orthonormal; NaN and 0 beyond a smaller mesh's last.
    * vertex_areas: barycentric lumped areas of the normalised mesh.
    * faces: triangles; face_source: the file's polygon each came from.
    * face_adjacency: neighbour across edges (0,1), (1,2), (2,0); -1 at a border or non-manifold edge.
    * face_labels, vertex_labels: index into the data set's classes, -1 unlabelled; None where there are none.
    * mesh_label: class of the whole mesh, -1 for none.
    * polygons: faces of the mesh file; vertex_source: its vertex that each is or lies nearest to, None without steps.
    * correspondence: the vertex at each of the M vertices of a template, -1 none; None where there is no template.
    """

    vertices: Float32[np.ndarray, "V 3"]
    vertex_normals: Float32[np.ndarray, "V 3"]
    dihedral: Float32[np.ndarray, " V"]
    hks: Float32[np.ndarray, "V T"]
    vertex_areas: Float32[np.ndarray, " V"]
    faces: Int32[np.ndarray, "F 3"]
    face_adjacency: Int32[np.ndarray, "F 3"]
    face_source: Int32[np.ndarray, " F"]
    times: Float64[np.ndarray, " T"]
    centre: Float64[np.ndarray, " 3"]
    scale: float
    hks_poles: int
    hks_error_bound: float
    face_labels: Int16[np.ndarray, " F"] | None = None
    vertex_labels: Int16[np.ndarray, " V"] | None = None
    dihedral_signed: Float32[np.ndarray, " V"] | None = None
    dihedral_official: Float32[np.ndarray, "V 3"] | None = None
    geodesic: Float32[np.ndarray, "V 10"] | None = None
    shape_diameter: Float32[np.ndarray, "V 2"] | None = None
    eigenvalues: Float64[np.ndarray, " K"] | None = None
    eigenvectors: Float32[np.ndarray, "V K"] | None = None
    vertex_source: Int32[np.ndarray, " V"] | None = None
    correspondence: Int32[np.ndarray, " M"] | None = None
    mesh_label: int = -1
    polygons: int = 0
    diagnostics: Mapping[str, int] = field(default_factory=lambda: dict.fromkeys(DIAGNOSTICS, 0))
    id: str = ""
    source: str = ""
    source_sha256: str = ""
    key: str = ""
    split: str = ""
    group: str = ""
    label_domain: str = ""
    label_rule: str = ""

    @classmethod
    def of_checked(cls, values: dict[str, Any]) -> "Sample":
        """A sample whose values the reader has checked, without the constructor: setting thirty frozen fields one
        by one takes half as long as copying a mesh. `values` has `diagnostics` and all that has no default."""
        sample = object.__new__(cls)
        sample.__dict__.update(values)
        return sample

    @property
    def used_vertices(self) -> Bool[np.ndarray, " V"]:
        """Vertices that have features: those of a face with three different corners."""
        return self.hks[:, 0] > 0

    @property
    def face_areas(self) -> Float32[np.ndarray, " F"]:
        """Areas of the triangles of the normalised mesh."""
        a, b, c = (self.vertices[self.faces[:, corner]] for corner in range(3))
        return np.linalg.norm(np.cross(b - a, c - a), axis=1) / np.float32(2)

    @property
    def original_vertices(self) -> Float64[np.ndarray, "V 3"]:
        """Positions in the unit and place of the mesh file, to float32's rounding of the normalised ones."""
        return self.vertices * self.scale + self.centre

    @property
    def digest(self) -> str:
        """sha256 over the arrays and numbers, not over names: two samples with one digest hold the same data."""
        parts = []
        for name in DIGESTED:
            value = getattr(self, name)
            if value is not None:
                array = np.ascontiguousarray(value)
                parts += [f"{name} {array.dtype.str} {array.shape};".encode(), array.tobytes()]
        parts.append(repr(sorted(self.diagnostics.items())).encode())
        return hashlib.sha256(b"".join(parts)).hexdigest()


DIGESTED = (
    "vertices",
    "vertex_normals",
    "dihedral",
    "hks",
    "vertex_areas",
    "faces",
    "face_adjacency",
    "face_source",
    "times",
    "centre",
    "scale",
    "hks_poles",
    "hks_error_bound",
    "face_labels",
    "vertex_labels",
    "dihedral_signed",
    "dihedral_official",
    "geodesic",
    "shape_diameter",
    "eigenvalues",
    "eigenvectors",
    "vertex_source",
    "correspondence",
    "mesh_label",
    "polygons",
)
