"""Mesh files with something wrong, each a pure function of a number: a shape, what is done to its geometry, the
format it is written in, and what is done to the bytes. Run as a program, it holds the preparation against them."""

import random
import resource
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from corrupt_bytes import BYTES, WRITERS, obj
from corrupt_geometry import GEOMETRY
from shapes import bumpy, fin, grid, joined, sphere, tetrahedron, torus

from meshshard.errors import REFUSALS, InvalidMesh
from meshshard.recipe import RECIPES, Recipe
from meshshard.sample import DIGESTED, Sample
from meshshard_prep.formats import parse_mesh
from meshshard_prep.pipeline import features_of

SHAPES = [
    tetrahedron(),
    sphere(1),
    sphere(2),
    grid(4, 3),
    torus(8, 6),
    fin(),
    bumpy(5, 1),
    joined(sphere(1), grid(2, 2)),
]

SOME_PAIRS = replace(RECIPES["paper"], components="bridged", spectrum=5, name="bridged-spectrum5")
RECIPE_OF = [RECIPES["paper"]] * 8 + [RECIPES["official"], SOME_PAIRS]
"""Recipes that are tried, the standard one most often."""


def corrupted(seed: int) -> tuple[str, bytes]:
    """Mesh file number `seed`, and what was done to it."""
    rng = random.Random(seed)
    shape = rng.randrange(len(SHAPES))
    v, f = SHAPES[shape][0].copy(), SHAPES[shape][1].tolist()
    on_geometry = rng.choices(GEOMETRY, k=rng.choice([0, 1, 1, 1, 2, 3]))
    on_bytes = rng.choices(BYTES, k=rng.choice([0, 0, 1, 1, 2]))
    done: list[Callable[..., object]] = []
    with np.errstate(all="ignore"):
        for change in on_geometry:
            if len(v) < 3 or not f or any(len(face) < 3 or not 0 <= min(face) <= max(face) < len(v) for face in f):
                break  # some changes need three corners that are there
            v, f = change(v, f, rng)
            done.append(change)
    writer = rng.choice(WRITERS)
    data = writer(v, f, rng)
    for damage in on_bytes:
        data = damage(data or b"\n", rng)
    return " ".join([f"shape {shape}", *(c.__name__ for c in (*done, writer, *on_bytes))]), data


def outcome(data: bytes, recipe: Recipe) -> str:
    """The digest of the sample, which is finite and whole, or the code of the refusal."""
    try:
        sample = features_of(parse_mesh(data, "m"), recipe, place="m")
    except InvalidMesh as error:
        refused = error
    else:
        check_whole(sample)
        return sample.digest
    assert refused.code in REFUSALS
    assert refused.place.startswith("m"), f"no place: {refused}"
    assert refused.advice, f"no advice: {refused}"
    return refused.code


def check_whole(sample: Sample) -> None:
    """Every number is finite and every index leads somewhere."""
    for name in DIGESTED:
        value = getattr(sample, name)
        if value is not None and name != "eigenvalues":  # NaN where a mesh has fewer
            assert np.isfinite(value).all(), f"{name} is not finite"
    assert 0 <= sample.faces.min() <= sample.faces.max() < len(sample.vertices)
    assert -1 <= sample.face_adjacency.min() <= sample.face_adjacency.max() < len(sample.faces)
    assert (sample.hks[sample.used_vertices] > 0).all()
    assert (sample.hks[~sample.used_vertices] == 0).all()
    assert ((sample.dihedral >= 0) & (sample.dihedral <= np.float32(np.pi))).all()
    assert (sample.vertex_areas >= 0).all()
    assert abs(np.linalg.norm(sample.vertices[np.unique(sample.faces)], axis=1).max() - 1) < 1e-6


def hold(first: int, count: int, megabytes: int) -> None:
    """Try `count` files in this process, which takes at most that much memory more. A line before and after each."""
    features_of(parse_mesh(obj(*SHAPES[0], random.Random(0)), ""), SOME_PAIRS)  # compiled and loaded before the limit
    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + megabytes * 2**20, resource.RLIM_INFINITY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    for seed in range(first, first + count):
        what, data = corrupted(seed)
        recipe = RECIPE_OF[seed % len(RECIPE_OF)]
        print(f"{seed} {recipe.name}: {what}", flush=True)
        start = time.perf_counter()
        found = outcome(data, recipe)
        seconds = time.perf_counter() - start
        assert outcome(data, recipe) == found, "the second time it was another"
        print(f"= {found} {seconds:.3f}", flush=True)


if __name__ == "__main__":
    hold(*map(int, sys.argv[1:]))
