"""Turning angles across edges, and their means at vertices."""

import numpy as np
from jaxtyping import Bool, Float64, Int64

from meshshard_prep.features.edges import Edges, mean_at_ends
from meshshard_prep.features.normals import cross, face_normals


def turning_angles(
    vertices: Float64[np.ndarray, "V 3"], faces: Int64[np.ndarray, "F 3"], edges: Edges
) -> tuple[Int64[np.ndarray, " P"], Float64[np.ndarray, " P"], Bool[np.ndarray, " P"]]:
    """Interior edges, the angle between the normals of their two faces, and whether these are wound alike.

    Radians: flat 0, folded shut pi, negative where the surface bends towards the normals (a concave edge). Faces
    that are not wound alike are oriented so first; their angle's sign is as the first of them sees it. Edges of a
    face without area are left out: it has no normal.
    """
    interior, halves = edges.pairs
    normals = face_normals(vertices, faces)
    left, right = normals[halves[:, 0] // 3], normals[halves[:, 1] // 3]
    tails = faces.ravel()[halves]
    alike = tails[:, 0] != tails[:, 1]
    right = np.where(alike[:, None], right, -right)
    axis = cross(left, right)
    angle = np.arctan2(np.linalg.norm(axis, axis=1), np.einsum("pi,pi->p", left, right))
    along = vertices[faces[:, [1, 2, 0]].ravel()[halves[:, 0]]] - vertices[tails[:, 0]]
    angle = np.where(np.einsum("pi,pi->p", axis, along) < 0, -angle, angle)
    defined = left.any(axis=1) & right.any(axis=1)
    return interior[defined], angle[defined], alike[defined]


def mean_dihedral(
    vertices: Float64[np.ndarray, "V 3"], faces: Int64[np.ndarray, "F 3"], edges: Edges
) -> Float64[np.ndarray, " V"]:
    """Mean size of the turning angle at a vertex over its interior edges, radians. Flat is 0, folded shut pi.

    Border and non-manifold edges are left out; a vertex without interior edge gets 0.
    """
    interior, angle, _ = turning_angles(vertices, faces, edges)
    return mean_at_ends(edges.ends[interior], np.abs(angle), len(vertices))


def mean_signed_dihedral(
    vertices: Float64[np.ndarray, "V 3"], faces: Int64[np.ndarray, "F 3"], edges: Edges
) -> Float64[np.ndarray, " V"]:
    """`mean_dihedral` with signs: convex positive, concave negative, where the faces' normals point outward.

    An edge whose two faces are not wound alike has no outside, and is left out too.
    """
    interior, angle, alike = turning_angles(vertices, faces, edges)
    return mean_at_ends(edges.ends[interior[alike]], angle[alike], len(vertices))


def official_dihedral(
    vertices: Float64[np.ndarray, "V 3"],
    faces: Int64[np.ndarray, "F 3"],
    adjacency: Int64[np.ndarray, "F 3"],
) -> Float64[np.ndarray, "V 3"]:
    """The published code's "dihedral": three channels a vertex, the means over its faces of exp(1 - |n_i . n_j|).

    Channel c looks across side c of each face (0,1), (1,2), (2,0); a missing neighbour counts |n_i . n_j| = 1. It
    is no angle, and which neighbour comes in which channel depends on the order of the corners.
    """
    normals = face_normals(vertices, faces)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    unit = np.divide(normals, length, out=np.zeros_like(normals), where=length > 0)
    cosine = np.abs(np.einsum("fi,fci->fc", unit, unit[adjacency]))
    value = np.exp(1 - np.where(adjacency < 0, 1.0, cosine))
    corners = faces.ravel()
    count = np.bincount(corners, minlength=len(vertices))
    total = [np.bincount(corners, np.repeat(value[:, c], 3), minlength=len(vertices)) for c in range(3)]
    return np.stack(total, axis=1) / np.maximum(count, 1)[:, None]
