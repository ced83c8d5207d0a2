from dataclasses import replace
from itertools import combinations, pairwise

import numpy as np
import pytest
from scipy.spatial.distance import cdist
from shapes import FAMILY, bumpy, grid, joined, rotation, sphere

from meshshard.recipe import RECIPES
from meshshard_prep.features.bridges import bridges
from meshshard_prep.features.edges import edges_of
from meshshard_prep.pipeline import components_of, compute_features

PAPER = RECIPES["paper"]
BRIDGED = replace(PAPER, components="bridged")


def links(vertices, faces):
    edges = edges_of(faces)
    _, piece_of = components_of(edges, len(vertices))
    return *bridges(vertices, edges, piece_of), piece_of


def scattered(seed, pieces):
    """Small bumpy spheres at random places in a unit ball."""
    rng = np.random.default_rng(seed)
    meshes = [bumpy(int(rng.integers(100)), 0) for _ in range(pieces)]
    places = rng.uniform(-0.5, 0.5, (pieces, 3))
    turned = [
        0.05 * v @ rotation(number) + place for number, ((v, _), place) in enumerate(zip(meshes, places, strict=True))
    ]
    return joined(*zip(turned, [f for _, f in meshes], strict=True), step=0)


def two_spheres(gap):
    """Two spheres whose nearest vertices are `gap` apart on the x axis."""
    vertices, faces = sphere(2)
    return joined((vertices, faces), (vertices, faces), step=2 + gap)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("pieces", [2, 3, 12])
def test_is_the_shortest_tree(seed, pieces):
    """Against Kruskal's algorithm on all distances."""
    vertices, faces = scattered(seed, pieces)
    pairs, weights, piece_of = links(vertices, faces)
    members = [vertices[piece_of == piece] for piece in range(pieces)]
    gaps = sorted((cdist(members[a], members[b]).min(), a, b) for a, b in combinations(range(pieces), 2))
    tree, group = [], list(range(pieces))
    for gap, a, b in gaps:
        if group[a] != group[b]:
            tree.append(gap)
            group = [group[a] if g == group[b] else g for g in group]
    found = np.linalg.norm(vertices[pairs[:, 0]] - vertices[pairs[:, 1]], axis=1)
    np.testing.assert_allclose(found, tree)
    assert len(weights) == pieces - 1


def test_weight_is_edge_length_over_gap():
    vertices, faces = joined(grid(2, 2), grid(2, 2), step=2.5)
    pairs, weights, _ = links(vertices, faces)
    assert len(pairs) == 1
    near = vertices[pairs[0]]
    assert abs(near[0, 0] - near[1, 0]) == pytest.approx(0.5)
    ends = edges_of(faces).ends
    length = np.linalg.norm(vertices[ends[:, 0]] - vertices[ends[:, 1]], axis=1)
    mean = [length[(ends == vertex).any(axis=1)].mean() for vertex in pairs[0]]
    assert weights[0] == pytest.approx(np.mean(mean) / 0.5)


@pytest.mark.parametrize("size", [1e-4, 1e-6, 1e-8])
def test_specks_are_joined_by_their_nearest_vertices(size):
    speck = size * bumpy(1, 0)[0], bumpy(1, 0)[1]
    vertices, faces = joined(
        sphere(1), (speck[0] + [2, 0, 0], speck[1]), (speck[0] + [2 + 3 * size, 0, 0], speck[1]), step=0
    )
    pairs, _, piece_of = links(vertices, faces)
    between = [pair for pair in pairs if 0 not in piece_of[pair]]
    assert len(between) == 1
    found = np.linalg.norm(np.subtract(*vertices[between[0]]))
    assert found == pytest.approx(cdist(vertices[piece_of == 1], vertices[piece_of == 2]).min())


def test_flat_pieces_and_touching_vertices_are_joined():
    vertices, faces = joined(grid(2, 2), grid(2, 2), grid(2, 2), step=2.0)  # they share whole sides
    pairs, weights, _ = links(vertices, faces)
    assert len(pairs) == 2
    np.testing.assert_allclose(weights, 1e6)


def test_touching_spheres_tend_to_the_joined_shape():
    vertices, faces = two_spheres(0.0)
    joined_shape = compute_features(vertices, faces)  # welded at the vertex that they share
    assert joined_shape.diagnostics["components"] == 1
    errors = []
    for gap in (1e-1, 1e-2, 1e-3, 1e-4):
        sample = compute_features(*two_spheres(gap), BRIDGED)
        assert (sample.diagnostics["components"], sample.diagnostics["bridges"]) == (2, 1)
        errors.append(np.abs(sample.hks / joined_shape.hks - 1).max())
    assert all(after < before / 5 for before, after in pairwise(errors))
    assert errors[-1] < 1e-3


def test_far_pieces_are_joined_weakly():
    near, far = (links(*two_spheres(gap))[1][0] for gap in (0.5, 50))
    assert near == pytest.approx(100 * far)
    assert compute_features(*two_spheres(0.5)).diagnostics["bridges"] == 0


def test_does_not_depend_on_motion_unit_or_pieces_that_are_one():
    vertices, faces = joined(bumpy(1, 1), bumpy(2, 2), bumpy(3, 0))
    plain = compute_features(vertices, faces, BRIDGED)
    assert plain.diagnostics["bridges"] == 2
    moved = compute_features(300 * vertices @ rotation(3) + 7, faces, BRIDGED)
    np.testing.assert_allclose(moved.hks, plain.hks, rtol=1e-6)
    one = compute_features(*FAMILY["bumpy"], BRIDGED)
    np.testing.assert_array_equal(one.hks, compute_features(*FAMILY["bumpy"]).hks)


def test_heat_flows_between_the_pieces():
    """At long times a bridged mesh knows its whole area, a separate piece only its own."""
    vertices, faces = two_spheres(0.1)
    late = replace(PAPER, times=(1000.0,))
    separate = compute_features(vertices, faces, late)
    bridged = compute_features(vertices, faces, replace(late, components="bridged"))
    np.testing.assert_allclose(bridged.hks, separate.hks / 2, rtol=1e-4)
    np.testing.assert_allclose(bridged.hks, 1 / bridged.vertex_areas.sum(), rtol=1e-4)
