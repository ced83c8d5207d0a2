import numpy as np
import pytest
from shapes import FAMILY

from meshshard_prep.features.adjacency import face_adjacency
from meshshard_prep.features.edges import edges_of


@pytest.mark.parametrize("name", FAMILY)
def test_against_brute_force(name):
    _, faces = FAMILY[name]
    found = face_adjacency(edges_of(faces))
    sides = [[frozenset((f[i], f[(i + 1) % 3])) for i in range(3)] for f in faces.tolist()]
    for face, row in enumerate(found.tolist()):
        for side, neighbour in enumerate(row):
            others = [g for g in range(len(faces)) if g != face and sides[face][side] in sides[g]]
            assert neighbour == (others[0] if len(others) == 1 else -1)


@pytest.mark.parametrize("name", FAMILY)
def test_neighbours_are_mutual(name):
    _, faces = FAMILY[name]
    found = face_adjacency(edges_of(faces))
    for face, side in np.argwhere(found >= 0):
        assert face in found[found[face, side]]
