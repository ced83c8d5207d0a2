"""Generated meshes with known answers. Faces are wound outward."""

from itertools import pairwise
from pathlib import Path

import numpy as np


def tetrahedron():
    vertices = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], dtype=float)
    return vertices, np.array([[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]])


def box(a=1.0, b=1.0, c=1.0):
    """A box with sides a, b, c: 8 vertices, 12 triangles."""
    vertices = np.array([[x, y, z] for x in (0, a) for y in (0, b) for z in (0, c)], dtype=float)
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    return vertices, np.array([t for q in quads for t in ([q[0], q[1], q[2]], [q[0], q[2], q[3]])])


def sphere(level=2):
    """A subdivided octahedron on the unit sphere: 4 * 4^level + 2 vertices."""
    vertices = [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]]
    faces = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]]
    points = [np.array(v, dtype=float) for v in vertices]
    for _ in range(level):
        middle, finer = {}, []
        for face in faces:
            between = []
            for tail, head in pairwise([*face, face[0]]):
                edge = (min(tail, head), max(tail, head))
                if edge not in middle:
                    middle[edge] = len(points)
                    point = points[tail] + points[head]
                    points.append(point / np.linalg.norm(point))
                between.append(middle[edge])
            a, b, c = face
            x, y, z = between
            finer += [[a, x, z], [x, b, y], [z, y, c], [x, y, z]]
        faces = finer
    return np.array(points), np.array(faces)


def grid(n=4, m=4):
    """An open flat sheet of n x m squares of side 1, normal +z."""
    vertices = np.array([[i, j, 0] for i in range(n + 1) for j in range(m + 1)], dtype=float)
    at = lambda i, j: i * (m + 1) + j  # noqa: E731
    faces = [
        t
        for i in range(n)
        for j in range(m)
        for t in ([at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)])
    ]
    return vertices, np.array(faces)


def torus(n=12, m=8, r=0.4):
    """A torus of n x m squares."""
    u, v = np.meshgrid(2 * np.pi * np.arange(n) / n, 2 * np.pi * np.arange(m) / m, indexing="ij")
    ring = 1 + r * np.cos(v)
    vertices = np.stack([ring * np.cos(u), ring * np.sin(u), r * np.sin(v)], axis=-1).reshape(-1, 3)
    at = lambda i, j: (i % n) * m + j % m  # noqa: E731
    faces = [
        t
        for i in range(n)
        for j in range(m)
        for t in ([at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)])
    ]
    return vertices, np.array(faces)


def joined(*meshes, step=3.0):
    """Meshes side by side as one, in several pieces."""
    vertices, faces, start = [], [], 0
    for number, (v, f) in enumerate(meshes):
        vertices.append(v + np.array([step * number, 0, 0]))
        faces.append(f + start)
        start += len(v)
    return np.concatenate(vertices), np.concatenate(faces)


def fin():
    """A sphere with one more triangle on an edge that has two already: non-manifold."""
    vertices, faces = sphere(1)
    a, b = faces[0, 0], faces[0, 1]
    tip = (vertices[a] + vertices[b]) * 0.9
    return np.vstack([vertices, tip]), np.vstack([faces, [[a, b, len(vertices)]]])


def bumpy(seed, level=2):
    """A sphere with random radii: no symmetry, no two equal features."""
    vertices, faces = sphere(level)
    return vertices * (1 + 0.3 * np.random.default_rng(seed).random((len(vertices), 1))), faces


def rotation(seed=0):
    """A random proper rotation."""
    q, _ = np.linalg.qr(np.random.default_rng(seed).standard_normal((3, 3)))
    return q * np.sign(np.linalg.det(q))


FAMILY = {
    "tetrahedron": tetrahedron(),
    "box": box(1, 2, 3),
    "sphere": sphere(2),
    "sheet": grid(5, 4),
    "torus": torus(),
    "pieces": joined(sphere(1), box(), grid(2, 2)),
    "fin": fin(),
    "bumpy": bumpy(1),
}


def write_obj(path: Path, vertices, faces):
    """A plain OBJ file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    lines = [f"v {x!r} {y!r} {z!r}\n" for x, y, z in np.asarray(vertices).tolist()]
    lines += [f"f {' '.join(str(i + 1) for i in face)}\n" for face in np.asarray(faces).tolist()]
    path.write_text("".join(lines))


def write_off(path: Path, vertices, faces, keyword="OFF\n"):
    """A plain OFF file; ModelNet's keyword has no line of its own."""
    path.parent.mkdir(parents=True, exist_ok=True)
    lines = [f"{keyword}{len(vertices)} {len(faces)} 0\n"]
    lines += [f"{x!r} {y!r} {z!r}\n" for x, y, z in np.asarray(vertices).tolist()]
    lines += [f"{len(face)} {' '.join(map(str, face))}\n" for face in np.asarray(faces).tolist()]
    path.write_text("".join(lines))


def write_ply(path: Path, vertices, faces):
    """A plain PLY file, as text."""
    path.parent.mkdir(parents=True, exist_ok=True)
    lines = ["ply\nformat ascii 1.0\n", f"element vertex {len(vertices)}\n"]
    lines += [f"property float {axis}\n" for axis in "xyz"]
    lines += [f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"]
    lines += [f"{x!r} {y!r} {z!r}\n" for x, y, z in np.asarray(vertices).tolist()]
    lines += [f"{len(face)} {' '.join(map(str, face))}\n" for face in np.asarray(faces).tolist()]
    path.write_text("".join(lines))


def write_labels(path: Path, labels):
    """One integer a line."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("".join(f"{label}\n" for label in labels))
