"""Arms, legs and tentacles of aliens, in poses."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from meshshard_prep.minicoseg.classes import CLASSES
from meshshard_prep.minicoseg.parts import curve, egg, pipe, xyz
from meshshard_prep.minicoseg.shape import THIN, Part

_LIMBS = CLASSES.index("alien limbs")

Parts = tuple[Part, ...]
Vector = NDArray[np.float64]


def draw_limbs(rng: np.random.Generator, centre: Vector, radii: Vector) -> Parts:
    """Limbs of the body that is about an ellipsoid: legs in one of four kinds, and arms but for spiders."""
    kinds = (_two_legs, _two_legs, _tripod, _spider_legs, _tentacles)
    kind = kinds[rng.integers(len(kinds))]
    legs = kind(rng, centre, radii)
    lowest = 1.3 if kind is _tentacles else 0.7
    return legs if kind is _spider_legs else (*legs, *_arms(rng, centre, radii, lowest))


def _two_legs(rng: np.random.Generator, centre: Vector, radii: Vector) -> Parts:
    """Standing or walking, with feet."""
    thick, apart = rng.uniform(0.045, 0.056), rng.uniform(0.6, 1.1)
    stride = rng.choice([0.0, rng.uniform(0.08, 0.16)])
    limbs: list[Part] = []
    for side in (-1, 1):
        hip = centre + radii * [0.5 * side, -0.7, 0]
        foot = np.array([apart * radii[0] * side, THIN, side * stride])
        knee = (hip + foot) / 2 + xyz(0.02 * side, 0.0, 0.02 + 0.3 * stride)
        limbs += [
            pipe(_LIMBS, [hip, knee, foot], [thick, thick, THIN]),
            egg(_LIMBS, foot + xyz(0.01 * side, 0.0, 0.045), [0.055, 0.045, 0.085]),
        ]
    return tuple(limbs)


def _tripod(rng: np.random.Generator, centre: Vector, radii: Vector) -> Parts:
    """Three straight legs, one of them behind."""
    thick, spread = rng.uniform(0.045, 0.055), rng.uniform(0.2, 0.32)
    leg = [[0.4 * radii[0], centre[1] - 0.5 * radii[1]], [spread, THIN]]
    return tuple(_outwards(turn, leg, [thick, THIN]) for turn in np.pi * np.array([1 / 3, 1, 5 / 3]))


def _spider_legs(rng: np.random.Generator, centre: Vector, radii: Vector) -> Parts:
    """Four or six legs with raised knees."""
    count, knee, reach = int(rng.choice([4, 6])), rng.uniform(-0.05, 0.12), rng.uniform(0.34, 0.45)
    leg = [[0.5 * radii[0], centre[1] - 0.3 * radii[1]], [0.27, centre[1] + knee], [reach, THIN]]
    turns = np.pi * (2 * np.arange(count) + 1) / count
    return tuple(_outwards(turn, leg, [0.046, 0.044, THIN]) for turn in turns)


def _tentacles(rng: np.random.Generator, centre: Vector, radii: Vector) -> Parts:
    """Four to six, curled outwards, each a little different."""
    count, curl = int(rng.integers(4, 7)), rng.uniform(0.08, 0.2)
    root = np.array([0.4 * radii[0], centre[1] - 0.55 * radii[1]])
    tentacles: list[Part] = []
    for turn in 2 * np.pi * (np.arange(count) + rng.random()) / count:
        reach, lift = rng.uniform(0.34, 0.48), curl * rng.uniform(0.6, 1.2)
        controls = np.array([root, [0.16, 0.0], [0.75 * reach, -0.05], [reach, THIN + lift]])
        tentacles.append(_outwards(turn, curve(controls, 8), np.linspace(0.058, THIN, 8)))
    return tuple(tentacles)


def _outwards(turn: float, profile: ArrayLike, radii: ArrayLike) -> Part:
    """Limb along points (outwards, y), in the direction `turn` about the y axis, 0 to the front."""
    out, up = np.asarray(profile, dtype=np.float64).T
    return pipe(_LIMBS, np.column_stack([out * np.sin(turn), up, out * np.cos(turn)]), radii)


def _arms(rng: np.random.Generator, centre: Vector, radii: Vector, lowest: float) -> Parts:
    """A left and a right arm, alike in half of the poses, with hands or two fingers each.

    `lowest` is the least angle between a hanging and the drawn upper arm.
    """
    alike, fingers = rng.random() < 0.5, rng.random() < 0.4
    poses = rng.uniform([lowest, -0.2, 0.0], [1.8, 0.7, 0.5], size=(2, 3))
    upper, lower = rng.uniform(0.15, 0.2, size=2)
    limbs: list[Part] = []
    for side, (lift, bend, ahead) in zip((-1, 1), poses[[0, 0]] if alike else poses, strict=True):
        shoulder = centre + radii * [0.7 * side, 0.5, 0]
        elbow = shoulder + (0.4 * radii[0] + upper) * np.array([side * np.sin(lift), -np.cos(lift), 0])
        reach = np.array([side * np.sin(lift + bend), -np.cos(lift + bend), ahead])
        wrist = elbow + lower * reach
        limbs.append(pipe(_LIMBS, [shoulder, elbow, wrist], [0.047, 0.044, THIN]))
        if fingers:
            spread = 0.06 * np.array([np.cos(lift + bend), side * np.sin(lift + bend), 0])
            limbs += [pipe(_LIMBS, [wrist, wrist + 0.08 * reach + way * spread], THIN) for way in (-1, 1)]
        else:
            limbs.append(egg(_LIMBS, wrist + 0.03 * reach, 0.055))
    return tuple(limbs)
