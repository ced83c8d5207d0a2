"""The published preparation, written out in plain scipy and potpourri3d: the peer that speed is measured against."""

from pathlib import Path

import numpy as np
import potpourri3d as pp3d
import scipy.sparse as sp
from jaxtyping import Float64, Int64
from scipy.sparse.linalg import eigsh

SHIFT = 1e-8


def operators(
    vertices: Float64[np.ndarray, "V 3"], faces: Int64[np.ndarray, "F 3"]
) -> tuple[sp.csc_matrix, Float64[np.ndarray, " V"]]:
    """Cotangent Laplacian plus 1e-8 I and barycentric mass, as DiffusionNet and the paper's code build them."""
    stiffness = pp3d.cotan_laplacian(vertices, faces, denom_eps=1e-10) + SHIFT * sp.identity(len(vertices))
    mass = pp3d.vertex_areas(vertices, faces)
    return sp.csc_matrix(stiffness), mass + SHIFT * mass.mean()


def heat_kernel_signature(
    stiffness: sp.csc_matrix, mass: Float64[np.ndarray, " V"], times: tuple[float, ...], pairs: int
) -> Float64[np.ndarray, "V T"]:
    """The sum over `pairs` eigenpairs from shift-invert Lanczos."""
    values, modes = eigsh(stiffness, k=pairs, M=sp.diags(mass), sigma=SHIFT)
    return np.square(modes) @ np.exp(-np.outer(np.maximum(values, 0), times))


def prepare(path: Path, times: tuple[float, ...], pairs: int) -> list[np.ndarray]:
    """An OBJ file to positions, normals, three-channel "dihedral" and HKS. Its loops are vectorised here."""
    vertices_read, faces_read = [], []
    for line in path.read_text().splitlines():
        words = line.split()
        if words and words[0] == "v":
            vertices_read.append([float(word) for word in words[1:4]])
        elif words and words[0] == "f":
            faces_read.append([int(word.split("/")[0]) - 1 for word in words[1:4]])
    vertices, faces = np.array(vertices_read), np.array(faces_read)
    vertices = vertices - vertices.mean(axis=0)
    vertices = vertices / np.linalg.norm(vertices, axis=1).max()
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    normals = np.cross(b - a, c - a)
    normals = normals / (np.linalg.norm(normals, axis=1, keepdims=True) + 1e-12)
    at_vertices = np.zeros_like(vertices)
    np.add.at(at_vertices, faces.ravel(), np.repeat(normals, 3, axis=0))
    neighbour: dict[tuple[int, int], int] = {}
    for face, corners in enumerate(faces.tolist()):
        for tail, head in zip(corners, corners[1:] + corners[:1], strict=True):
            neighbour[tail, head] = face
    across = np.array(
        [
            [neighbour.get((head, tail), face) for tail, head in zip(corners, corners[1:] + corners[:1], strict=True)]
            for face, corners in enumerate(faces.tolist())
        ]
    )
    channels = np.exp(1 - np.abs(np.einsum("fi,fci->fc", normals, normals[across])))
    dihedral, count = np.zeros_like(vertices), np.bincount(faces.ravel(), minlength=len(vertices))
    np.add.at(dihedral, faces.ravel(), np.repeat(channels, 3, axis=0))
    hks = heat_kernel_signature(*operators(vertices, faces), times, pairs)
    return [vertices, at_vertices, dihedral / count[:, None], hks]
