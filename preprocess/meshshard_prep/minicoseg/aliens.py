"""Aliens: a head with eyes or feelers, a body, and limbs. They look along +z and stand on about y = 0."""

import numpy as np
from numpy.typing import NDArray

from meshshard_prep.minicoseg.alien_heads import draw_head
from meshshard_prep.minicoseg.alien_limbs import draw_limbs
from meshshard_prep.minicoseg.classes import CLASSES
from meshshard_prep.minicoseg.parts import bar, egg, xyz
from meshshard_prep.minicoseg.shape import Part, Shape

_BODY = CLASSES.index("alien body")


def draw_alien(rng: np.random.Generator) -> Shape:
    """Two-legged, three-legged, spider-legged or with tentacles; see `draw_limbs`."""
    radii = np.array([rng.uniform(0.11, 0.18), rng.uniform(0.15, 0.22), rng.uniform(0.11, 0.16)])
    centre = np.array([0, rng.uniform(0.42, 0.56), 0])
    top = centre + xyz(0.0, radii[1], 0.0)
    limbs = draw_limbs(rng, centre, radii)
    head = draw_head(rng, top)
    return Shape((*_body(rng, centre, radii), *head, *limbs), blend=0.035)


def _body(rng: np.random.Generator, centre: NDArray[np.float64], radii: NDArray[np.float64]) -> tuple[Part, ...]:
    """An egg, a pear or a barrel, and the neck."""
    neck = bar(_BODY, centre, centre + xyz(0.0, radii[1] + 0.02, 0.0), 0.05)
    match rng.integers(3):
        case 0:
            return egg(_BODY, centre, radii), neck
        case 1:
            belly = egg(_BODY, centre - xyz(0.0, 0.3 * radii[1], 0.0), radii * [1.1, 0.75, 1.1])
            return belly, egg(_BODY, centre + xyz(0.0, 0.35 * radii[1], 0.0), radii * [0.75, 0.65, 0.75]), neck
        case _:
            ends = np.outer([-0.35, 0.35], [0, radii[1], 0]) + centre
            return bar(_BODY, ends[0], ends[1], 0.9 * radii[0], 0.75 * radii[0]), neck
