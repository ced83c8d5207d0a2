"""What a chair stands on, in seven styles.

All reach from the floor to the seat's underside at y = `top`, and meet it within x = +-wide, z = +-deep.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from meshshard_prep.minicoseg.classes import CLASSES
from meshshard_prep.minicoseg.parts import bar, block, pipe, plate, xyz
from meshshard_prep.minicoseg.shape import THIN, Part

_LEGS = CLASSES.index("chair legs")

Parts = tuple[Part, ...]


def draw_legs(rng: np.random.Generator, wide: float, deep: float, top: float) -> Parts:
    """Legs in a style that the generator picks."""
    styles: tuple[Callable[..., Parts], ...] = (_four, _four, _square, _three, _star, _column, _sled, _sides)
    return styles[rng.integers(len(styles))](rng, wide, deep, top)


def _four(rng: np.random.Generator, wide: float, deep: float, top: float) -> Parts:
    corners = np.array([[x, 0, z] for x in (-wide, wide) for z in (-deep, deep)])
    legs, knots = _splayed(rng, corners, top)
    stretchers = rng.random() < 0.4
    return (*legs, *(bar(_LEGS, knots[i], knots[i + 1], THIN) for i in (0, 2) if stretchers))


def _three(rng: np.random.Generator, wide: float, deep: float, top: float) -> Parts:
    turns = np.pi * np.array([1 / 3, 1, 5 / 3])
    return _splayed(rng, np.column_stack([wide * np.sin(turns), 0 * turns, deep * np.cos(turns)]), top)[0]


def _splayed(rng: np.random.Generator, corners: NDArray[np.float64], top: float) -> tuple[Parts, NDArray[np.float64]]:
    """Tapered legs below the corners, (N, 3) on the floor, and a point part way up each of them."""
    thick, thin = rng.uniform(THIN, 0.052), THIN
    upper = corners + xyz(0.0, top, 0.0)
    lower = corners * rng.choice([1.0, rng.uniform(1.1, 1.4)]) + xyz(0.0, thin, 0.0)
    share = rng.uniform(0.3, 0.5)
    legs = tuple(bar(_LEGS, low, high, thin, thick) for low, high in zip(lower, upper, strict=True))
    return legs, (1 - share) * lower + share * upper


def _square(rng: np.random.Generator, wide: float, deep: float, top: float) -> Parts:
    thick = rng.uniform(THIN, 0.05)
    half = [thick, top / 2 + 0.01, thick]
    return tuple(block(_LEGS, [x, top / 2, z], half, 0.025) for x in (-wide, wide) for z in (-deep, deep))


def _sides(rng: np.random.Generator, wide: float, deep: float, top: float) -> Parts:
    half = [THIN, top / 2 + 0.01, deep * rng.uniform(0.6, 1.0)]
    return tuple(block(_LEGS, [x, top / 2, 0], half, 0.035) for x in (-wide, wide))


def _sled(rng: np.random.Generator, wide: float, deep: float, top: float) -> Parts:
    thick, lean = rng.uniform(THIN, 0.05), rng.uniform(0.9, 1.2) * deep
    frame = np.array([[0, top, -deep], [0, thick, -lean], [0, thick, lean], [0, top, deep]])
    return tuple(pipe(_LEGS, frame + xyz(x, 0.0, 0.0), thick) for x in (-wide, wide))


def _star(rng: np.random.Generator, wide: float, deep: float, top: float) -> Parts:
    arms = int(rng.integers(3, 6))
    turns = 2 * np.pi * (np.arange(arms) + 0.25) / arms
    reach = rng.uniform(1.0, 1.25) * min(wide, deep)
    tips = reach * np.column_stack([np.sin(turns), 0 * turns, np.cos(turns)]) + xyz(0.0, THIN, 0.0)
    hub = [0, THIN + rng.uniform(0.03, 0.08), 0]
    return (
        bar(_LEGS, hub, [0, top, 0], rng.uniform(THIN, 0.055)),
        *(bar(_LEGS, hub, tip, THIN) for tip in tips),
    )


def _column(rng: np.random.Generator, wide: float, deep: float, top: float) -> Parts:
    foot = plate(_LEGS, [0, THIN, 0], rng.uniform(0.75, 1.0) * min(wide, deep), THIN, 0.035)
    return foot, bar(_LEGS, [0, 0.05, 0], [0, top, 0], rng.uniform(0.045, 0.08), rng.uniform(0.045, 0.06))
