"""Handles of a vase."""

import numpy as np
from jaxtyping import Float64

from meshshard_prep.minicoseg.classes import CLASSES
from meshshard_prep.minicoseg.parts import curve, pipe
from meshshard_prep.minicoseg.shape import THIN, Part

_HANDLE = CLASSES.index("vase handle")


def draw_handles(
    rng: np.random.Generator, outline: Float64[np.ndarray, "P 2"], heights: Float64[np.ndarray, "4"]
) -> tuple[Part, ...]:
    """None, one or two ears, or a basket's over a mouth that is wide enough.

    `outline` is the whole (radius, y) from the floor up, `heights` where base, body and neck begin and where it ends.
    """
    kind = rng.choice(["none", "ear", "ears", "basket"], p=[0.32, 0.28, 0.3, 0.1])
    thick = rng.uniform(THIN, 0.048)
    if kind == "none":
        return ()
    lip, top = outline[-1]
    if kind == "basket" and lip > 0.12:
        foot, rise = [lip - 0.03, top - 0.03, 0], [0.04, rng.uniform(0.3, 0.4), 0]
        right = np.array([foot, np.add(foot, rise)])
        return (pipe(_HANDLE, curve([*right, *(right[::-1] * [-1, 1, 1])], 12), thick),)
    body, neck = heights[1:3]
    share = rng.uniform(0.45, 0.8, size=2)
    upper = rng.choice([neck + share[0] * (top - neck), neck - 0.1 * (neck - body)])
    lower = min(body + (share[1] - 0.25) * (neck - body), upper - 0.22)
    inner = np.interp([upper, lower], outline[:, 1], outline[:, 0])
    beside = outline[(outline[:, 1] > lower) & (outline[:, 1] < upper), 0]
    outer = beside.max() + rng.uniform(0.2, 0.27)
    path = curve(
        [
            [inner[0] - 0.03, upper, 0],
            [outer, upper + 0.06, 0],
            [outer, lower + 0.08, 0],
            [inner[1] - 0.03, lower, 0],
        ],
        10,
    )
    sides = (1, -1) if kind == "ears" else (1,)
    return tuple(pipe(_HANDLE, path * [side, 1, 1], thick) for side in sides)
