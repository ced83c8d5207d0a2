"""Conversions against dictionaries and counters, on meshes with borders, fins, pieces and polygons."""

from collections import Counter, defaultdict

import numpy as np
import pytest
from polygons import POLYGONS, fans, obj_text

from meshshard_prep.features.edges import edges_of
from meshshard_prep.formats import parse_mesh
from meshshard_prep.labels import labels_of
from meshshard_prep.labels.convert import faces_to_edges, two_of_three

TRIANGLES = [name for name in POLYGONS if name != "quads"]


def majority(labels):
    """The label that at least two have."""
    found = [label for label, votes in Counter(labels).items() if votes >= 2 and label >= 0]
    return found[0] if found else -1


def winner(labels):
    """The label that most have, the lowest of several; -1 does not count."""
    votes = Counter(label for label in labels if label >= 0)
    return min(votes, key=lambda label: (-votes[label], label)) if votes else -1


def numbered_edges(faces):
    """Two ends -> number, in the order in which a walk over the faces meets them."""
    numbers = {}
    for a, b, c in faces:
        for edge in ((a, b), (b, c), (c, a)):
            numbers.setdefault(tuple(sorted(edge)), len(numbers))
    return numbers


def sides(face, numbers):
    a, b, c = face
    return [numbers[tuple(sorted(edge))] for edge in ((a, b), (b, c), (c, a))]


def around(faces, labels, parts_of):
    """Part of a face -> labels of the faces that have it."""
    found = defaultdict(list)
    for face, label in zip(faces, labels, strict=True):
        for part in set(parts_of(face)):
            found[part].append(label)
    return found


def mesh_of(name):
    vertices, faces = POLYGONS[name]
    return vertices, faces, parse_mesh(obj_text(vertices, faces).encode(), name)


@pytest.fixture(params=list(POLYGONS))
def case(request):
    return mesh_of(request.param)


@pytest.fixture(params=[0, 1, 2])
def rng(request):
    return np.random.default_rng(request.param)


def drawn(rng, count):
    return rng.integers(-1, 3, count)


def test_faces_to_vertices(case, rng):
    vertices, faces, mesh = case
    labels = drawn(rng, len(faces))
    found = labels_of(mesh, labels, ("face",), "", "vertex")
    of_vertex = around(faces, labels.tolist(), lambda face: face)
    assert found.vertices.tolist() == [winner(of_vertex[number]) for number in range(len(vertices))]
    assert (found.domain, found.faces) == ("face", None)
    assert found.rule == (
        "vertex: the label of most of its labelled faces, the lowest of several; without one unlabelled"
    )


def test_vertices_to_faces(case, rng):
    vertices, faces, mesh = case
    labels = drawn(rng, len(vertices))
    found = labels_of(mesh, labels, ("vertex",), "", "face")
    triangles = [(face[0], face[i], face[i + 1]) for face in faces for i in range(1, len(face) - 1)]
    assert found.faces.tolist() == [majority([labels[corner] for corner in triangle]) for triangle in triangles]
    assert (found.domain, found.vertices) == ("vertex", None)
    assert found.rule == "face: the label of two of its three corners; else unlabelled"


@pytest.mark.parametrize("name", TRIANGLES)
@pytest.mark.parametrize("to", ["", "face", "vertex"])
def test_edges_to_faces_and_on_to_vertices(name, rng, to):
    vertices, faces, mesh = mesh_of(name)
    numbers = numbered_edges(faces)
    labels = drawn(rng, len(numbers))
    found = labels_of(mesh, labels, ("edge",), "", to)
    of_faces = [majority([labels[side] for side in sides(face, numbers)]) for face in faces]
    rule = "face: the label of two of its three edges; else unlabelled"
    assert found.domain == "edge"
    if to == "vertex":
        of_vertex = around(faces, of_faces, lambda face: face)
        assert found.vertices.tolist() == [winner(of_vertex[number]) for number in range(len(vertices))]
        assert found.rule.startswith(f"{rule}; then vertex: the label of most")
    else:
        assert found.faces.tolist() == of_faces
        assert found.rule == rule


@pytest.mark.parametrize(("domain", "to"), [("face", ""), ("face", "face"), ("vertex", ""), ("vertex", "vertex")])
def test_what_is_not_converted_has_no_rule(case, rng, domain, to):
    vertices, faces, mesh = case
    labels = drawn(rng, len(faces if domain == "face" else vertices))
    found = labels_of(mesh, labels, (domain,), "", to)
    assert (found.domain, found.rule) == (domain, "")
    stored, expected = (found.faces, fans(faces, labels)) if domain == "face" else (found.vertices, labels.tolist())
    assert stored.tolist() == expected


@pytest.mark.parametrize("name", TRIANGLES)
def test_faces_to_edges(name, rng):
    _, faces = POLYGONS[name]
    labels = drawn(rng, len(faces))
    edges = edges_of(np.array(faces))
    numbers = numbered_edges(faces)
    of_edge = around(faces, labels.tolist(), lambda face: sides(face, numbers))
    found = faces_to_edges(labels, edges.of_face, len(edges.ends))
    assert found.tolist() == [winner(of_edge[number]) for number in range(len(numbers))]


@pytest.mark.parametrize("name", TRIANGLES)
def test_faces_to_edges_and_back(name, rng):
    _, faces = POLYGONS[name]
    edges = edges_of(np.array(faces))
    labels = rng.integers(0, 3, len(faces))
    numbers = numbered_edges(faces)
    of_edge = around(faces, labels.tolist(), lambda face: sides(face, numbers))
    back = two_of_three(faces_to_edges(labels, edges.of_face, len(edges.ends))[edges.of_face])
    for face, before, after in zip(faces, labels.tolist(), back.tolist(), strict=True):
        # an edge is lost to a lower label across it, or to two equal ones at a fin; one lost edge changes nothing
        lost = [winner(of_edge[side]) != before for side in sides(face, numbers)]
        assert sum(lost) > 1 or after == before
    for constant in (0, 5):
        same = np.full(len(faces), constant)
        assert (two_of_three(faces_to_edges(same, edges.of_face, len(edges.ends))[edges.of_face]) == constant).all()


def test_three_labels_give_one_where_two_agree():
    three = np.array([[1, 1, 1], [1, 1, 2], [1, 2, 1], [2, 1, 1], [0, 1, 2], [-1, -1, 1], [-1, 1, 1], [-1, 1, 2]])
    assert two_of_three(three).tolist() == [1, 1, 1, 1, -1, -1, 1, -1]
