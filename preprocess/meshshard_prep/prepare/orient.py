"""The step orient: neighbours are wound alike, and closed pieces outwards."""

from dataclasses import replace

import igl
import numpy as np
from jaxtyping import Bool, Int64

from meshshard_prep.facts import disagreeing
from meshshard_prep.features.edges import Edges, edges_of
from meshshard_prep.prepare.traced import Traced


def orient(mesh: Traced) -> tuple[Traced, dict[str, int]]:
    """Turn faces over so that the two faces of every edge agree, as far as that can be; corners are reversed.

    A patch is what hangs together over edges with exactly two faces, after merging vertices at the same point. A
    closed one is turned outwards, so that its volume is positive, also one that lies inside another. One that is
    open, flat or not orientable is turned as most of its faces were; what cannot agree (a Moebius strip) is cut
    where the flood from its lowest face ends. Faces with a repeated corner are left alone.
    """
    working = mesh.working()
    flooded, patch_of = (found.astype(np.int64) for found in igl.bfs_orient(working.faces))
    turned = (flooded != working.faces).any(axis=1)
    patches = int(patch_of.max()) + 1
    edges = edges_of(flooded)
    solid = _closed(edges, patch_of, patches) & _agreeing(flooded, edges, patch_of, patches)
    volume = np.bincount(patch_of, np.linalg.det(working.vertices[flooded]), minlength=patches)
    outwards = np.where(solid, np.sign(volume), 0)
    most = np.bincount(patch_of, turned, minlength=patches) > np.bincount(patch_of, minlength=patches) / 2
    turned ^= np.where(outwards != 0, outwards < 0, most)[patch_of]
    faces = mesh.faces.copy()
    faces[working.face_map[turned]] = faces[working.face_map[turned], ::-1]
    return replace(mesh, faces=faces), {"turned_faces": int(turned.sum())}


def _closed(edges: Edges, patch_of: Int64[np.ndarray, " F"], patches: int) -> Bool[np.ndarray, " P"]:
    """Patches that have exactly two faces at each of their edges, whatever else is there."""
    at = patch_of[:, None] * len(edges.count) + edges.of_face
    pairs, count = np.unique(at, return_counts=True)
    return np.bincount(pairs[count != 2] // len(edges.count), minlength=patches) == 0


def _agreeing(
    faces: Int64[np.ndarray, "F 3"], edges: Edges, patch_of: Int64[np.ndarray, " F"], patches: int
) -> Bool[np.ndarray, " P"]:
    """Patches whose faces agree at every edge with two: those that are orientable, once they are flooded."""
    _, halves = edges.pairs
    return np.bincount(patch_of[halves[disagreeing(faces, edges), 0] // 3], minlength=patches) == 0
