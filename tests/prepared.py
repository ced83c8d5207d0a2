"""Meshes for the steps of preparing, and what a step made of one."""

import numpy as np

from meshshard_prep.mesh import RawMesh
from meshshard_prep.prepare.traced import Traced, traced


def raw_mesh(vertices, faces) -> RawMesh:
    """A triangle mesh as its file would say it; its arrays cannot be written to."""
    vertices, faces = np.array(vertices, dtype=float), np.array(faces, dtype=np.int64)
    vertices.flags.writeable = faces.flags.writeable = False
    return RawMesh(vertices=vertices, faces=faces, face_source=np.arange(len(faces)), polygons=len(faces))


def start(vertices, faces) -> Traced:
    """A mesh before its first step."""
    return traced(raw_mesh(vertices, faces), "test.obj")


def soup(vertices, faces):
    """The same triangles, each with three vertices of its own."""
    return vertices[faces].reshape(-1, 3), np.arange(faces.size).reshape(-1, 3)


def volume(mesh: Traced) -> float:
    """Signed volume inside a closed mesh."""
    return float(np.linalg.det(mesh.vertices[mesh.faces]).sum() / 6)
