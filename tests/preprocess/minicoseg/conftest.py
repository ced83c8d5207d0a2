"""What the meshes of the data set are looked at with."""

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components


@dataclass(frozen=True)
class Anatomy:
    """`uses`: faces of each edge. `pinched`: vertices whose faces are not one fan or ring."""

    uses: np.ndarray
    oriented: bool
    components: int
    pinched: int
    euler: int
    volume: float
    smallest_area: float

    @property
    def closed(self):
        return bool((self.uses == 2).all()) and self.oriented and self.pinched == 0


def _fans(faces):
    """Corners joined across edges: one component per fan of a vertex."""
    corner = {}
    links = []
    for face, triangle in enumerate(faces.tolist()):
        for side in range(3):
            tail, head = triangle[side], triangle[(side + 1) % 3]
            here = (3 * face + side, 3 * face + (side + 1) % 3)
            for other in corner.setdefault((min(tail, head), max(tail, head)), []):
                links += zip(here if tail < head else here[::-1], other, strict=True)
            corner[min(tail, head), max(tail, head)].append(here if tail < head else here[::-1])
    one, two = np.array(links).T
    return connected_components(coo_array((np.ones(len(one)), (one, two)), shape=(faces.size, faces.size)))[0]


def _look(vertices, faces):
    directed = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    edges, uses = np.unique(np.sort(directed, axis=1), axis=0, return_counts=True)
    shape = (len(vertices), len(vertices))
    components = connected_components(coo_array((np.ones(len(edges)), edges.T), shape=shape))[0]
    first, second, third = vertices[faces].transpose(1, 0, 2)
    return Anatomy(
        uses=uses,
        oriented=len(np.unique(directed, axis=0)) == len(directed),
        components=components,
        pinched=_fans(faces) - len(np.unique(faces)),
        euler=len(vertices) - len(edges) + len(faces),
        volume=float(np.einsum("fc,fc->", first, np.cross(second, third)) / 6),
        smallest_area=float(np.linalg.norm(np.cross(second - first, third - first), axis=1).min() / 2),
    )


@pytest.fixture(scope="session")
def look():
    """Gives the Anatomy of vertices and faces."""
    return _look
