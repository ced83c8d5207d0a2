"""Shapes whose topology is known."""

import numpy as np
import pytest
from shapes import FAMILY, bumpy, fin, grid, joined, sphere, torus

from meshshard_prep.clean import clean
from meshshard_prep.facts import facts_of
from meshshard_prep.features.edges import edges_of
from meshshard_prep.pipeline import compute_features, counts_of


def facts(vertices, faces):
    mesh = clean(vertices, np.asarray(faces), weld=True)
    return facts_of(mesh.vertices, mesh.faces, edges_of(mesh.faces))


def strip(turns, n=12):
    """A band of 2n triangles, closed after that many half turns: a Moebius strip where they are odd."""
    angle = 2 * np.pi * np.arange(n) / n
    twist = turns * angle / 2
    rows = []
    for side in (-0.3, 0.3):
        radius = 1 + side * np.cos(twist)
        rows.append(np.stack([radius * np.cos(angle), radius * np.sin(angle), side * np.sin(twist)], axis=1))
    faces = []
    for i in range(n):
        a, b, c, d = i, n + i, (i + 1) % n, n + (i + 1) % n
        if i == n - 1 and turns % 2:
            c, d = d, c
        faces += [[a, b, c], [b, d, c]]
    return np.concatenate(rows), np.array(faces)


def bowtie():
    """Two tetrahedra that share one vertex."""
    vertices, faces = FAMILY["tetrahedron"]
    other = np.where(faces == 0, 0, faces + 3)
    return np.vstack([vertices, vertices[0] - (vertices[1:] - vertices[0])]), np.vstack([faces, other[:, ::-1]])


@pytest.mark.parametrize(
    ("mesh", "characteristic", "loops", "genus"),
    [
        (sphere(0), 2, 0, 0),
        (sphere(2), 2, 0, 0),
        (torus(), 0, 0, 1),
        (torus(20, 5), 0, 0, 1),
        (grid(3, 5), 1, 1, 0),
        (strip(0), 0, 2, 0),
        (strip(2), 0, 2, 0),
        (strip(4), 0, 2, 0),
        (strip(1), 0, 1, None),
        (strip(3), 0, 1, None),
        (joined(sphere(1), torus(), torus(), grid()), 2 + 0 + 0 + 1, 1, 2),
        (bowtie(), 3, 0, None),
        (fin(), 2, 1, None),
    ],
)
def test_euler_characteristic_loops_and_genus(mesh, characteristic, loops, genus):
    found = facts(*mesh)
    assert (found.euler_characteristic, found.boundary_loops, found.genus) == (characteristic, loops, genus)


@pytest.mark.parametrize("holes", range(1, 5))
def test_every_hole_is_a_loop(holes):
    vertices, faces = sphere(3)
    tips = [v for v in range(6)][:holes]  # the octahedron's corners are far from each other
    open_faces = faces[~np.isin(faces, tips).any(axis=1)]
    found = facts(vertices, open_faces)
    assert (found.boundary_loops, found.euler_characteristic, found.genus) == (holes, 2 - holes, 0)
    assert found.closed_pieces == 0


@pytest.mark.parametrize("turns", range(5))
def test_a_band_with_an_odd_number_of_half_turns_is_not_orientable(turns):
    found = facts(*strip(turns))
    assert found.orientable == (turns % 2 == 0)
    assert (found.disagreeing_edges > 0) == (turns % 2 == 1)


@pytest.mark.parametrize("seed", range(5))
def test_a_flipped_face_disagrees_with_its_three_neighbours(seed):
    vertices, faces = sphere(2)
    rng = np.random.default_rng(seed)
    one = faces.copy()
    one[seed] = one[seed, ::-1]
    found = facts(vertices, one)
    assert (found.disagreeing_edges, found.orientable, found.inside_out_pieces, found.genus) == (3, True, 0, 0)
    flipped = rng.random(len(faces)) < 0.5
    some = np.where(flipped[:, None], faces[:, ::-1], faces)
    edges = edges_of(faces)
    ends = edges.pairs[1] // 3
    assert facts(vertices, some).disagreeing_edges == (flipped[ends[:, 0]] != flipped[ends[:, 1]]).sum()


def test_inside_out_is_a_closed_piece_of_negative_volume():
    vertices, faces = sphere(1)
    inside_out = vertices, faces[:, ::-1]
    assert facts(*inside_out).inside_out_pieces == 1
    assert facts(*joined(sphere(1), inside_out, torus(), inside_out)).inside_out_pieces == 2
    assert facts(vertices, faces).inside_out_pieces == 0
    assert facts(vertices, faces[1:, ::-1]).inside_out_pieces == 0  # open: no volume
    assert facts(vertices + 100, faces).inside_out_pieces == 0


def test_pieces_are_counted_by_their_faces():
    found = facts(*joined(grid(1, 1), sphere(1), sphere(0)))
    assert (found.piece_faces, found.closed_pieces) == ((32, 8, 2), 2)


def test_vertices_with_more_than_one_fan():
    assert facts(*bowtie()).bowtie_vertices == 1
    assert facts(*fin()).bowtie_vertices == 0  # its edge is non-manifold, and around each end the faces are one fan
    vertices, faces = joined(*[sphere(1)] * 4)
    shared = np.where(np.isin(faces, [18, 36, 54]), 0, faces)  # the first vertex of each becomes one
    assert facts(vertices, shared).bowtie_vertices == 1
    assert facts(*FAMILY["sheet"]).bowtie_vertices == 0


@pytest.mark.parametrize("seed", range(3))
def test_duplicate_faces_in_any_order(seed):
    rng = np.random.default_rng(seed)
    vertices, faces = bumpy(seed, 1)
    again = rng.permuted(faces[rng.integers(len(faces), size=5)], axis=1)
    assert facts(vertices, np.vstack([faces, again])).duplicate_faces == 5
    assert facts(vertices, faces).duplicate_faces == 0


@pytest.mark.parametrize("exponent", [-3, -6, -9, -10])
def test_what_float32_cannot_tell_apart(exponent):
    size = 10.0**exponent
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.6, 0.6, 0], [0.6, 0.6, size], [0.6 + size, 0.6, 0]])
    found = facts(vertices, [[0, 1, 2], [3, 4, 5]])
    assert found.edge_ratio == pytest.approx(np.sqrt(2) / size, rel=1e-5)
    lost = {-3: 0, -6: 0, -9: 1, -10: 1}[exponent]  # along z, near 0, float32 is finer than along x
    assert found.float32_collisions == lost


@pytest.mark.parametrize("scale", [1e-5, 1, 1e7])
def test_moving_turning_and_scaling_change_nothing(scale):
    vertices, faces = FAMILY["pieces"]
    moved = facts(vertices * scale, np.roll(faces, 1, axis=1)[::-1])
    first = facts(vertices, faces)
    assert moved.edge_ratio == pytest.approx(first.edge_ratio)
    assert {**vars(moved), "edge_ratio": 0} == {**vars(first), "edge_ratio": 0}


@pytest.mark.parametrize("name", FAMILY)
def test_counts_are_those_that_a_sample_stores(name):
    mesh = clean(*FAMILY[name], weld=True)
    edges = edges_of(mesh.faces)
    stored = compute_features(*FAMILY[name]).diagnostics
    counts = counts_of(mesh, edges)
    assert counts.items() <= stored.items()
    found = facts_of(mesh.vertices, mesh.faces, edges)
    assert len(found.piece_faces) == stored["components"]
    assert sum(found.piece_faces) == len(mesh.faces)
    assert (found.boundary_loops > 0) == (stored["boundary_edges"] > 0)
