"""Meshes whose faces have any number of corners, as lists, and the triangles that a fan makes of them."""

import numpy as np
from shapes import FAMILY, grid


def quads(n=3, m=2):
    """A sheet of squares, with a triangle, a pentagon and a face that has one corner twice."""
    vertices, _ = grid(n, m)
    at = lambda i, j: i * (m + 1) + j  # noqa: E731
    faces = [[at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)] for i in range(n) for j in range(m)]
    tip = len(vertices)
    vertices = np.vstack([vertices, [[0, -1, 0], [1, -1, 0], [0.5, -2, 0]]])
    faces += [[at(0, 0), tip, at(1, 0)], [tip, tip + 2, tip + 1, at(1, 0), at(0, 0)], [tip, tip + 1, tip + 2, tip]]
    return vertices, faces


POLYGONS = {name: (vertices, faces.tolist()) for name, (vertices, faces) in FAMILY.items()} | {"quads": quads()}
"""Every shape of `shapes.FAMILY`, and one of larger polygons; some have borders, fins or several pieces."""


def fans(faces, labels):
    """The label of each triangle, where each polygon is cut into a fan."""
    return [label for face, label in zip(faces, labels, strict=True) for _ in face[2:]]


def obj_text(vertices, faces, before=lambda _number: ""):
    """An OBJ file; `before` gives the statements in front of face `number`, which counts from 0."""
    lines = [f"v {x!r} {y!r} {z!r}\n" for x, y, z in np.asarray(vertices).tolist()]
    lines += [f"{before(i)}f {' '.join(str(corner + 1) for corner in face)}\n" for i, face in enumerate(faces)]
    return "".join(lines)
