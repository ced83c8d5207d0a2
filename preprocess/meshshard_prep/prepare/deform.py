"""Meshes of other shapes from one: what a limb is does not depend on how thick or long it is."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float64

from meshshard_prep.clean import clean
from meshshard_prep.features.normals import vertex_normals
from meshshard_prep.mesh import RawMesh

THICKNESS, THICKENED = 0.012, 0.25
"""Deviation of the way along the normals, for the whole mesh and for each of some places; and how wide these are."""
GROWTH, GROWN = 0.15, 0.35
"""Deviation of the logarithmic growth about each of some places, and how wide these are."""
STRETCH = 0.06
"""Deviation of the entries of a symmetric matrix that stretches and shears the whole mesh."""
NOISE = 0.001
"""Deviation of each coordinate. All of these are in radii of the mesh."""
PLACES_THICKENED, PLACES_GROWN = 12, 6


def deformed(mesh: RawMesh, seed: list[int], *, place: str = "") -> RawMesh:
    """A mesh with the same faces whose vertices are moved smoothly, the same for the same seed: some places are made
    thicker or thinner, some larger or smaller, all is stretched. Vertices at one point stay together.

    InvalidMesh: the mesh breaks a rule of `clean`.
    """
    working = clean(mesh.vertices, mesh.faces, weld=True, place=place)
    normals = working.to_vertices(vertex_normals(working.vertices, working.faces))
    rng = np.random.default_rng(seed)
    noise = working.to_vertices(rng.normal(scale=NOISE, size=working.vertices.shape))
    moved = _thicker(working.positions, normals, working.vertices, rng)
    moved = _grown(moved, working.vertices, rng)
    half = rng.normal(scale=STRETCH, size=(3, 3))
    moved = moved @ (np.eye(3) + (half + half.T) / 2) + noise
    return replace(mesh, vertices=moved * working.scale + working.centre)


def _thicker(
    points: Float64[np.ndarray, "V 3"],
    normals: Float64[np.ndarray, "V 3"],
    surface: Float64[np.ndarray, "W 3"],
    rng: np.random.Generator,
) -> Float64[np.ndarray, "V 3"]:
    """Points moved along their normals, by a way that changes smoothly in space."""
    places = surface[rng.integers(len(surface), size=PLACES_THICKENED)]
    ways = rng.normal(scale=THICKNESS, size=PLACES_THICKENED)
    whole = rng.normal(scale=THICKNESS)
    way = whole + sum(ways[i] * _bump(points, places[i], THICKENED) for i in range(PLACES_THICKENED))
    return points + way * normals


def _grown(
    points: Float64[np.ndarray, "V 3"], surface: Float64[np.ndarray, "W 3"], rng: np.random.Generator
) -> Float64[np.ndarray, "V 3"]:
    """Points moved away from some places, or towards them."""
    places = surface[rng.integers(len(surface), size=PLACES_GROWN)]
    for spot, growth in zip(places, rng.normal(scale=GROWTH, size=PLACES_GROWN), strict=True):
        points = points + np.expm1(growth) * (points - spot) * _bump(points, spot, GROWN)
    return points


def _bump(
    points: Float64[np.ndarray, "V 3"], spot: Float64[np.ndarray, " 3"], width: float
) -> Float64[np.ndarray, "V 1"]:
    return np.exp(-np.square(points - spot).sum(axis=1, keepdims=True) / (2 * width**2))
