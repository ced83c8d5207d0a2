"""The working copy: what operators may safely be built on, with the maps back to the file's vertices and faces."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64, Int64

from meshshard.errors import InvalidMesh

_AGAIN = "export the mesh again"
_FLOAT32_MAX = float(np.finfo(np.float32).max)


@dataclass(frozen=True, eq=False, kw_only=True)
class Mesh:
    """A mesh in two forms. V and F count the file's vertices and triangles, W and G those of the working copy.

    `positions` (V,3): the file's vertices, centred at the mean of the referenced ones and scaled to radius 1.
    `vertices` (W,3), `faces` (G,3): the working copy: welded, without degenerate faces, every vertex in a face.
    `vertex_map` (V,): working vertex of a file vertex, -1 where no kept face uses it.
    `face_map` (G,): file triangle of a working face.
    """

    positions: Float64[np.ndarray, "V 3"]
    original_faces: Int64[np.ndarray, "F 3"]
    vertices: Float64[np.ndarray, "W 3"]
    faces: Int64[np.ndarray, "G 3"]
    vertex_map: Int64[np.ndarray, " V"]
    face_map: Int64[np.ndarray, " G"]
    centre: Float64[np.ndarray, " 3"]
    scale: float
    welded_vertices: int

    def to_vertices(self, values: np.ndarray) -> np.ndarray:
        """Values of the working vertices at the file's vertices; 0 where there is no working vertex."""
        padded = np.concatenate([values, np.zeros_like(values[:1])])
        return padded[self.vertex_map]


def clean(
    vertices: Float64[np.ndarray, "V 3"], faces: Int64[np.ndarray, "F 3"], *, weld: bool, place: str = ""
) -> Mesh:
    """Validate a mesh and make its working copy. The arrays given are not changed.

    InvalidMesh: no vertices or faces, an index outside, NaN or infinity, no extent, only degenerate faces, a vertex
    without a face that float32 cannot hold in radii.
    """
    _validate(vertices, faces, place)
    referenced = np.zeros(len(vertices), dtype=bool)
    referenced[faces.ravel()] = True
    centre, scale = _frame(vertices[referenced], place)
    positions = _normalised(vertices, centre, scale, place)

    merged = same_point(vertices, referenced) if weld else np.arange(len(vertices))
    corners = merged[faces]
    distinct = (corners[:, 0] != corners[:, 1]) & (corners[:, 1] != corners[:, 2]) & (corners[:, 2] != corners[:, 0])
    if not distinct.any():
        raise InvalidMesh(
            "no-faces",
            "a mesh has a face with three different corners",
            f"all {len(faces)} are degenerate",
            place=place,
            advice="look whether corners that should differ lie at one point",
        )
    kept = np.zeros(len(vertices), dtype=bool)
    kept[corners[distinct].ravel()] = True
    number = np.where(kept, np.cumsum(kept) - 1, -1)
    return Mesh(
        positions=positions,
        original_faces=faces,
        vertices=positions[kept],
        faces=number[corners[distinct]],
        vertex_map=np.where(referenced, number[merged], -1),
        face_map=np.flatnonzero(distinct),
        centre=centre,
        scale=scale,
        welded_vertices=int((merged != np.arange(len(vertices))).sum()),
    )


def _validate(vertices: np.ndarray, faces: np.ndarray, place: str) -> None:
    if len(vertices) == 0:
        raise InvalidMesh("no-vertices", "a mesh has vertices", "it has none", place=place, advice=_AGAIN)
    if len(faces) == 0:
        raise InvalidMesh("no-faces", "a mesh has faces", "it has none", place=place, advice=_AGAIN)
    low, high = int(faces.min()), int(faces.max())
    if low < 0 or high >= len(vertices):
        raise InvalidMesh(
            "index-out-of-range",
            f"face indices lie between 0 and {len(vertices) - 1}",
            f"there is {low if low < 0 else high}",
            place=place,
            advice="count from 0; " + _AGAIN,
        )
    bad = np.flatnonzero(~np.isfinite(vertices).all(axis=1))
    if len(bad):
        raise InvalidMesh(
            "not-finite",
            "coordinates are finite",
            f"vertex {bad[0]} is {vertices[bad[0]].tolist()} ({len(bad)} such vertices)",
            place=place,
            advice=_AGAIN,
        )


def _frame(points: np.ndarray, place: str) -> tuple[np.ndarray, float]:
    """Centre and scale that bring the points to mean 0 and maximum radius 1."""
    with np.errstate(over="ignore", invalid="ignore"):
        centre = points.mean(axis=0)
        scale = float(np.sqrt(np.square(points - centre).sum(axis=1).max()))
    if not (np.isfinite(scale) and scale > 1e-150):
        raise InvalidMesh(
            "no-extent",
            "a mesh has an extent whose square is a normal number",
            f"the largest distance from its centre is {scale}",
            place=place,
            advice="look at its unit and its outliers",
        )
    return centre, scale


def _normalised(vertices: np.ndarray, centre: np.ndarray, scale: float, place: str) -> np.ndarray:
    """Positions in radii from the centre: 1 at most for those of faces, and for others no more than float32 holds."""
    with np.errstate(over="ignore"):
        positions = (vertices - centre) / scale
    far = np.flatnonzero(~(np.abs(positions) <= _FLOAT32_MAX).all(axis=1))
    if len(far):
        raise InvalidMesh(
            "far-vertex",
            f"every vertex lies within {_FLOAT32_MAX:.1e} radii of the mesh's centre",
            f"vertex {far[0]}, which no face uses, is {vertices[far[0]].tolist()} ({len(far)} such vertices)",
            place=place,
            advice="remove vertices that no face uses",
        )
    return positions


def same_point(vertices: Float64[np.ndarray, "V 3"], referenced: Bool[np.ndarray, " V"]) -> Int64[np.ndarray, " V"]:
    """Representative of each vertex: the first referenced one at the same point; itself where unreferenced."""
    used = np.flatnonzero(referenced)
    points = np.ascontiguousarray(vertices[used] + 0.0)  # -0.0 becomes 0.0: the two are one point
    order = np.lexsort(points.T)  # stable, so the first of equal points is the first in the file
    sorted_points = points[order]
    new = np.ones(len(used), dtype=bool)
    new[1:] = (sorted_points[1:] != sorted_points[:-1]).any(axis=1)
    first = order[new][np.cumsum(new) - 1]
    merged = np.arange(len(vertices))
    merged[used[order]] = used[first]
    return merged
