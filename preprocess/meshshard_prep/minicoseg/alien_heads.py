"""Heads of aliens, with what grows on them."""

import numpy as np
from numpy.typing import NDArray

from meshshard_prep.minicoseg.classes import CLASSES
from meshshard_prep.minicoseg.parts import bar, curve, egg, pipe, xyz
from meshshard_prep.minicoseg.shape import THIN, Part

_HEAD = CLASSES.index("alien head")

Parts = tuple[Part, ...]
Vector = NDArray[np.float64]


def draw_head(rng: np.random.Generator, top: Vector) -> Parts:
    """A head that sits on the point `top` of the body."""
    radii = rng.uniform(0.82, 1.02) * np.array(
        [[0.16, 0.16, 0.16], [0.22, 0.13, 0.15], [0.14, 0.2, 0.15], [0.15, 0.14, 0.23]][rng.integers(4)]
    )
    centre = top + xyz(0.0, 0.85 * radii[1], 0.2 * (radii[2] - 0.15))
    skull = (egg(_HEAD, centre, radii),)
    if rng.random() < 0.3:  # a chin under a round brain
        skull = (bar(_HEAD, centre + xyz(0.0, 0.04, -0.01), top + xyz(0.0, 0.06, 0.04), 0.15, 0.065),)
        radii = np.full(3, 0.145)
    growths = (_stalks, _feelers, _ears, _bulging_eyes)
    return (*skull, *growths[rng.integers(len(growths))](rng, centre, radii))


def _stalks(rng: np.random.Generator, centre: Vector, radii: Vector) -> Parts:
    """One to three upright stalks with an eye ball on each."""
    count = int(rng.integers(1, 4))
    long, eye = rng.uniform(0.1, 0.2), rng.uniform(0.064, 0.08)
    grown: list[Part] = []
    for lean in np.linspace(-1, 1, count) * 0.8 if count > 1 else [0.0]:
        root = centre + radii * [0.8 * np.sin(lean), 0.8 * np.cos(lean), 0]
        tip = centre + (radii + long) * [1.2 * np.sin(lean), np.cos(lean), 0.1]
        grown += [bar(_HEAD, root, tip, THIN), egg(_HEAD, tip, eye)]
    return tuple(grown)


def _feelers(rng: np.random.Generator, centre: Vector, radii: Vector) -> Parts:
    """Two bent feelers, with or without a knob."""
    long, wide = rng.uniform(0.18, 0.3), rng.uniform(0.12, 0.25)
    knob = rng.choice([THIN, 0.06])
    grown: list[Part] = []
    for side in (-1, 1):
        root = centre + radii * [0.4 * side, 0.75, 0]
        path = curve(
            [
                root,
                root + xyz(0.0, long, 0.0),
                root + xyz(0.5 * side * wide, long, 0.0),
                root + xyz(side * wide, long, 0.08),
            ],
            7,
        )
        grown += [pipe(_HEAD, path, THIN), egg(_HEAD, path[-1], knob)]
    return tuple(grown)


def _ears(rng: np.random.Generator, centre: Vector, radii: Vector) -> Parts:
    """Two pointed ears to the sides."""
    out = np.array([rng.uniform(0.12, 0.18), rng.uniform(0.0, 0.16), -0.02])
    roots = [centre + radii * [0.7 * side, 0.3, 0] for side in (-1, 1)]
    return tuple(
        bar(_HEAD, root, root + out * [side, 1, 1], 0.07, THIN) for root, side in zip(roots, (-1, 1), strict=True)
    )


def _bulging_eyes(rng: np.random.Generator, centre: Vector, radii: Vector) -> Parts:
    """One to three eyes that stand out of the face."""
    size = rng.uniform(0.06, 0.075)
    turns = {1: [0.0], 2: [-0.55, 0.55], 3: [-0.7, 0.0, 0.7]}[int(rng.integers(1, 4))]
    return tuple(egg(_HEAD, centre + radii * [np.sin(turn), 0.25, np.cos(turn)], size) for turn in turns)
