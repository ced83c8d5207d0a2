"""Vases: base, body and neck turned about the y axis, perhaps with handles left and right (+-x). Floor at y = 0."""

import numpy as np
from jaxtyping import Float64
from numpy.typing import NDArray

from meshshard_prep.minicoseg.classes import CLASSES
from meshshard_prep.minicoseg.implicit import revolved, smooth_union
from meshshard_prep.minicoseg.shape import Distance, Part, Shape
from meshshard_prep.minicoseg.vase_handles import draw_handles
from meshshard_prep.minicoseg.vase_profiles import draw_base, draw_body, draw_neck

_BASE, _BODY, _NECK = (CLASSES.index(f"vase {part}") for part in ("base", "body", "neck"))
_ROUNDING = 0.035
_WALL = 0.09
_RIM = 0.03


def draw_vase(rng: np.random.Generator) -> Shape:
    """About a third have no handle, the others one or two. The section is round, oval or fluted; a mouth that is wide
    enough is hollow."""
    widest = rng.uniform(0.19, 0.28)
    waist, throat = np.maximum(rng.uniform([0.4, 0.32], [0.7, 0.72]) * widest, 0.08)
    heights = np.cumsum([_ROUNDING, rng.uniform(0.07, 0.15), rng.uniform(0.32, 0.56), rng.uniform(0.12, 0.28)])
    base = draw_base(rng, heights[0], heights[1], waist, widest)
    body = draw_body(rng, heights[1], heights[2], waist, widest, throat)
    neck = draw_neck(rng, heights[2], heights[3], throat)
    flat, lobes = rng.choice([1, 1, rng.uniform(0.7, 0.85)]), int(rng.integers(5, 9))
    depth = rng.choice([0, 0, rng.uniform(0.04, 0.07)])

    def turned(outline: Float64[np.ndarray, "P 2"], grown: float = 0.0) -> Distance:
        profile, rounding = outline - [_ROUNDING, 0], _ROUNDING + grown
        return lambda points: revolved(_straightened(points, flat, lobes, depth), profile, rounding)

    wall, spout = _WALL / flat, turned(neck)
    if neck[:, 0].min() > wall + 0.045:
        above = neck[-1:] + np.array([0, 2 * wall])
        spout = _bored(spout, turned(np.concatenate([neck, above]), -wall))
    handles = draw_handles(rng, np.concatenate([base, body, neck]), heights)
    turnery = (Part(_BASE, turned(base)), Part(_BODY, turned(body)), Part(_NECK, spout))
    return Shape((*turnery, *handles), blend=0.012)


def _bored(solid: Distance, bore: Distance) -> Distance:
    """The solid less the bore, the rim rounded."""
    return lambda points: -smooth_union((-solid(points), bore(points)), _RIM)


def _straightened(points: NDArray[np.float64], flat: float, lobes: int, depth: float) -> NDArray[np.float64]:
    """Undoes that the section's z is shrunk by `flat` and its radius waved by 1 + depth cos(lobes angle)."""
    across = points * [1, 1, 1 / flat]
    wave = 1 + depth * np.cos(lobes * np.arctan2(across[:, 2], across[:, 0]))
    return across / np.column_stack([wave, np.ones_like(wave), wave])
