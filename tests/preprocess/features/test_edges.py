import numpy as np
import pytest
from shapes import FAMILY

from meshshard_prep.features.edges import edges_of


def meshcnn_order(faces):
    """The published loop, word for word in meaning: faces in order, ends sorted, numbered when first met."""
    numbers, of_face, count = {}, [], []
    for face in faces.tolist():
        row = []
        for side in range(3):
            edge = tuple(sorted((face[side], face[(side + 1) % 3])))
            if edge not in numbers:
                numbers[edge] = len(numbers)
                count.append(0)
            count[numbers[edge]] += 1
            row.append(numbers[edge])
        of_face.append(row)
    return list(numbers), of_face, count


@pytest.mark.parametrize("name", FAMILY)
def test_order_is_meshcnns(name):
    _, faces = FAMILY[name]
    edges = edges_of(faces)
    ends, of_face, count = meshcnn_order(faces)
    assert edges.ends.tolist() == [list(edge) for edge in ends]
    assert edges.of_face.tolist() == of_face
    assert edges.count.tolist() == count


def test_order_on_random_soups():
    rng = np.random.default_rng(0)
    for _ in range(50):
        faces = rng.integers(0, 8, size=(rng.integers(1, 30), 3))
        ends, of_face, count = meshcnn_order(faces)
        edges = edges_of(faces)
        assert (edges.ends.tolist(), edges.of_face.tolist(), edges.count.tolist()) == (
            [list(edge) for edge in ends],
            of_face,
            count,
        )


def test_pairs_are_the_two_sides_of_interior_edges():
    _, faces = FAMILY["fin"]
    edges = edges_of(faces)
    interior, halves = edges.pairs
    assert (edges.count[interior] == 2).all()
    assert (edges.of_face.ravel()[halves] == interior[:, None]).all()
    assert (halves[:, 0] != halves[:, 1]).all()
    assert len(interior) == (edges.count == 2).sum()


@pytest.mark.parametrize(("name", "characteristic"), [("tetrahedron", 2), ("sphere", 2), ("torus", 0), ("sheet", 1)])
def test_euler_characteristic(name, characteristic):
    vertices, faces = FAMILY[name]
    assert len(vertices) - len(edges_of(faces).ends) + len(faces) == characteristic
