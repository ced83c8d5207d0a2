"""The step simplify: fewer faces, by quadric edge collapse in a process of its own, and what they lie on."""

from dataclasses import replace

import igl
import numpy as np
from jaxtyping import Float64, Int64
from scipy.spatial import cKDTree

from meshshard.errors import InvalidMesh
from meshshard_prep.features.areas import face_areas
from meshshard_prep.isolated import memory_left
from meshshard_prep.isolation import Isolated, Limits, isolated
from meshshard_prep.lost import Lost
from meshshard_prep.prepare.quadric import collapse, load
from meshshard_prep.prepare.samples import sample_points
from meshshard_prep.prepare.traced import Traced


def simplify(mesh: Traced, target: int) -> tuple[Traced, dict[str, int]]:
    """Collapse edges of the working copy down to `target` faces, or as far as its topology allows.

    A mesh with no more faces stays as it is, and so does one whose topology allows no collapse. Each new vertex is
    told its nearest vertex of the mesh before, and each new triangle the nearest triangle before at `POINTS` points.
    InvalidMesh: nothing is left. UsageError: pymeshlab is not there. Lost: its process was.
    """
    counts = {"faces_before": len(mesh.faces)}
    if len(mesh.faces) <= target:
        return mesh, counts
    working = mesh.working()
    surface = np.flatnonzero(face_areas(working.vertices, working.faces) > 0)
    vertices, faces = _collapsed(working.vertices, working.faces, target)
    if len(faces) == len(working.faces):
        return mesh, counts  # its topology allows nothing
    if len(faces) == 0 or len(surface) == 0:
        raise InvalidMesh(
            "no-faces",
            "a simplified mesh has faces",
            f"none is left of {len(mesh.faces)}, {len(working.faces) - len(surface)} of them without area",
            place=mesh.place,
            advice="leave out simplify, or repair the mesh",
        )
    points = sample_points(vertices[faces])
    _, nearest, _ = igl.point_mesh_squared_distance(points.reshape(-1, 3), working.vertices, working.faces[surface])
    below = working.face_map[surface[nearest]].reshape(points.shape[:2])
    number, first = np.unique(working.vertex_map, return_index=True)
    first = first[number >= 0]  # vertex of the mesh before, of each working vertex
    _, beside = cKDTree(working.vertices).query(vertices)
    simplified = replace(
        mesh,
        vertices=vertices * working.scale + working.centre,
        faces=faces,
        vertex_source=mesh.vertex_source[first[beside]],
        triangle_sources=mesh.triangle_sources[below, 0],
    )
    return simplified, counts


def warm_up() -> None:
    """Start the process that loads pymeshlab. UsageError: it is not there."""
    _quadric().call(load, limits=Limits(seconds=None, memory=None))


def _quadric() -> Isolated:
    return isolated(load, program="meshshard_prep.prepare.quadric")


def _collapsed(
    vertices: Float64[np.ndarray, "V 3"], faces: Int64[np.ndarray, "F 3"], target: int
) -> tuple[Float64[np.ndarray, "W 3"], Int64[np.ndarray, "G 3"]]:
    limits = Limits(seconds=None, memory=memory_left())  # whoever limits the time of this process ends that one too
    try:
        return _quadric().call(collapse, vertices, faces, target, limits=limits)
    except Lost as lost:
        raise Lost(lost.code, f"while it was simplified, {lost.cause}") from None
