"""Turning angles across edges, and their means at vertices."""

import numpy as np
from jaxtyping import Float64, Int64

from meshshard_prep.features.edges import Edges
from meshshard_prep.features.normals import face_normals


def turning_angles(
    vertices: Float64[np.ndarray, "V 3"], faces: Int64[np.ndarray, "F 3"], edges: Edges
) -> tuple[Int64[np.ndarray, " P"], Float64[np.ndarray, " P"]]:
    """Interior edges and the angle between the normals of their two faces, radians: flat 0, folded shut pi.

    The two faces are oriented alike across the edge first, so the angle does not depend on how faces are wound.
    Edges of a face without area are left out: it has no normal.
    """
    interior, halves = edges.pairs()
    normals = face_normals(vertices, faces)
    left, right = normals[halves[:, 0] // 3], normals[halves[:, 1] // 3]
    tails = faces.ravel()[halves]
    same_direction = tails[:, 0] == tails[:, 1]
    right = np.where(same_direction[:, None], -right, right)
    sine = np.linalg.norm(np.cross(left, right), axis=1)
    angle = np.arctan2(sine, np.einsum("pi,pi->p", left, right))
    defined = left.any(axis=1) & right.any(axis=1)
    return interior[defined], angle[defined]


def mean_dihedral(
    vertices: Float64[np.ndarray, "V 3"], faces: Int64[np.ndarray, "F 3"], edges: Edges
) -> Float64[np.ndarray, " V"]:
    """Mean turning angle at a vertex over its interior edges, radians. Flat is 0, folded shut pi.

    Border and non-manifold edges are left out; a vertex without interior edge gets 0.
    """
    interior, angle = turning_angles(vertices, faces, edges)
    ends = edges.ends[interior]
    total = np.bincount(ends.ravel(), np.repeat(angle, 2), minlength=len(vertices))
    count = np.bincount(ends.ravel(), minlength=len(vertices))
    return total / np.maximum(count, 1)


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
