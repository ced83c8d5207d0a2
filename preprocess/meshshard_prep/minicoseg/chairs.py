"""Chairs: a seat on legs, mostly with a back. Front is +z, the floor y = 0. Arm rests belong to the back."""

import numpy as np

from meshshard_prep.minicoseg.chair_backs import draw_back
from meshshard_prep.minicoseg.chair_legs import draw_legs
from meshshard_prep.minicoseg.classes import CLASSES
from meshshard_prep.minicoseg.parts import block, plate
from meshshard_prep.minicoseg.shape import THIN, Shape

_SEAT = CLASSES.index("chair seat")


def draw_chair(rng: np.random.Generator) -> Shape:
    """Three in ten have a round seat, one in twelve is a stool without back."""
    high, thick = rng.uniform(0.36, 0.48), rng.uniform(THIN, 0.052)
    middle = np.array([0.0, high, 0.0])
    if rng.random() < 0.3:
        wide = deep = rng.uniform(0.21, 0.25)
        seat = plate(_SEAT, middle, wide, thick, 0.038)
        corner = 0.68  # how far out a leg or the back still stands on the seat
    else:
        wide, deep = rng.uniform(0.21, 0.28), rng.uniform(0.2, 0.25)
        seat = block(_SEAT, middle, [wide, thick, deep], 0.038)
        corner = 0.84
    legs = draw_legs(rng, corner * wide, corner * deep, high - thick)
    back = () if rng.random() < 0.08 else draw_back(rng, corner * wide + 0.03, deep, high)
    return Shape((seat, *legs, *back), blend=0.02)
