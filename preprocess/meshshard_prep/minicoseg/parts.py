"""Short names for labelled solids, as the families draw them. Points are any three numbers, y up."""

from collections.abc import Sequence
from functools import partial

import numpy as np
from numpy.typing import ArrayLike, NDArray

from meshshard_prep.minicoseg import implicit
from meshshard_prep.minicoseg.shape import Part

Numbers = ArrayLike | float  # numpy calls a float array-like, checkers at run time do not


def block(
    label: int, centre: Numbers, half: Numbers, rounding: float, turn: NDArray[np.float64] | None = None
) -> Part:
    """Box; the columns of `turn` are its axes."""
    return Part(
        label, partial(implicit.box, centre=_floats(centre), half=_floats(half), rounding=rounding, turn=turn)
    )


def plate(label: int, centre: Numbers, radius: float, half: float, rounding: float) -> Part:
    """Upright cylinder."""
    return Part(label, partial(implicit.disc, centre=_floats(centre), radius=radius, half=half, rounding=rounding))


def egg(label: int, centre: Numbers, radii: Numbers, turn: NDArray[np.float64] | None = None) -> Part:
    """Ellipsoid, a ball for one radius; the columns of `turn` are its axes."""
    sizes = np.broadcast_to(_floats(radii), 3)
    return Part(label, partial(implicit.ellipsoid, centre=_floats(centre), radii=sizes, turn=turn))


def bar(label: int, start: Numbers, end: Numbers, radius: float, end_radius: float | None = None) -> Part:
    """Round bar with ball ends, tapered if `end_radius` is given."""
    return pipe(label, [start, end], [radius, radius if end_radius is None else end_radius])


def pipe(label: int, path: Sequence[Numbers] | NDArray[np.float64], radii: Numbers) -> Part:
    """Round bar along a polyline; one radius for all of it or one for each of its points."""
    line = np.array([_floats(point) for point in path])
    return Part(label, partial(implicit.tube, path=line, radii=np.broadcast_to(_floats(radii), len(line))))


def curve(controls: Sequence[Numbers] | NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """Points of a cubic Bezier curve, (count, 3)."""
    t = np.linspace(0, 1, count)[:, None]
    weights = np.hstack([(1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t**2 * (1 - t), t**3])
    return weights @ np.array([_floats(point) for point in controls])


def xyz(x: float, y: float, z: float) -> NDArray[np.float64]:
    """A point or a shift."""
    return np.array([x, y, z], dtype=np.float64)


def _floats(numbers: Numbers) -> NDArray[np.float64]:
    return np.asarray(numbers, dtype=np.float64)
