"""What a chair's sitter leans on, in five styles, perhaps with arm rests."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from jaxtyping import Float64
from numpy.typing import NDArray

from meshshard_prep.minicoseg.classes import CLASSES
from meshshard_prep.minicoseg.implicit import box
from meshshard_prep.minicoseg.parts import bar, block, egg, pipe, xyz
from meshshard_prep.minicoseg.shape import THIN, Distance, Part

_BACK = CLASSES.index("chair back")

Parts = tuple[Part, ...]


@dataclass(frozen=True)
class _Frame:
    """The rectangle the back fills: `wide` to either side, `tall` along its slanted axis, from its foot."""

    foot: NDArray[np.float64]
    slant: float
    wide: float
    tall: float

    @property
    def turn(self) -> NDArray[np.float64]:
        """Columns: to the side, up along the back, out of its front."""
        cos, sin = np.cos(self.slant), np.sin(self.slant)
        return np.array([[1, 0, 0], [0, cos, sin], [0, -sin, cos]])

    def at(self, side: float, up: float) -> NDArray[np.float64]:
        """Point of the rectangle, `side` from -1 to 1 and `up` from 0 to 1."""
        return self.foot + self.turn @ xyz(self.wide * side, self.tall * up, 0.0)


def draw_back(rng: np.random.Generator, wide: float, deep: float, high: float) -> Parts:
    """Back of half width `wide` on the rear edge of a seat whose middle is at y = `high`, z = -deep..deep."""
    frame = _Frame(
        foot=np.array([0, high, 0.05 - 0.95 * deep]),
        slant=np.radians(rng.uniform(2, 18)),
        wide=wide - THIN,
        tall=rng.uniform(0.36, 0.56),
    )
    styles: tuple[Callable[..., Parts], ...] = (_panel, _curved, _oval, _rails, _spindles)
    back = styles[rng.integers(len(styles))](rng, frame)
    return (*back, *_arm_rests(rng, wide, deep, high)) if rng.random() < 0.25 else back


def _panel(rng: np.random.Generator, frame: _Frame) -> Parts:
    half = [frame.wide + THIN, frame.tall / 2, rng.uniform(THIN, 0.05)]
    return (block(_BACK, frame.at(0.0, 0.5), half, 0.038, frame.turn),)


def _curved(rng: np.random.Generator, frame: _Frame) -> Parts:
    """A panel whose sides come forward around the sitter."""
    half = np.array([frame.wide + THIN, frame.tall / 2, 0.046])
    panel = partial(box, centre=frame.at(0.0, 0.5), half=half, rounding=0.038, turn=frame.turn)
    return (Part(_BACK, partial(_bent, solid=panel, bend=rng.uniform(1.0, 2.2))),)


def _bent(points: Float64[np.ndarray, "N 3"], solid: Distance, bend: float) -> Float64[np.ndarray, " N"]:
    """The solid moved forward by bend x^2; a little more than the distance where that is steep."""
    return solid(points - np.outer(bend * points[:, 0] ** 2, [0, 0, 1]))


def _oval(rng: np.random.Generator, frame: _Frame) -> Parts:
    """A flat egg on two posts."""
    centre, tall = frame.at(0.0, 0.68), 0.42 * frame.tall
    posts = (bar(_BACK, frame.at(x, 0.0), frame.at(x, 0.6), THIN) for x in (-0.5, 0.5))
    return egg(_BACK, centre, [frame.wide + THIN, tall, rng.uniform(0.045, 0.06)], frame.turn), *posts


def _rails(_rng: np.random.Generator, frame: _Frame) -> Parts:
    """Two posts, two or three bars across."""
    up = np.linspace(0.4, 0.95, int(0.55 * frame.tall / 0.14) + 1)
    across = (bar(_BACK, frame.at(-1.0, share), frame.at(1.0, share), THIN) for share in up)
    return *_posts(frame), *across


def _spindles(_rng: np.random.Generator, frame: _Frame) -> Parts:
    """Two posts, a bar on top, and upright bars between."""
    inner = np.linspace(-1, 1, int(frame.wide / 0.07))[1:-1]
    top = bar(_BACK, frame.at(-1.0, 1.0), frame.at(1.0, 1.0), 0.05)
    return *_posts(frame), top, *(bar(_BACK, frame.at(x, 0.0), frame.at(x, 1.0), THIN) for x in inner)


def _posts(frame: _Frame) -> Parts:
    return tuple(bar(_BACK, frame.at(x, 0.0), frame.at(x, 1.0), 0.045) for x in (-1.0, 1.0))


def _arm_rests(rng: np.random.Generator, wide: float, deep: float, high: float) -> Parts:
    """Bars from the back forward and down to the seat."""
    level, front = high + rng.uniform(0.18, 0.23), rng.uniform(0.4, 0.7) * deep
    side = wide - THIN
    path = np.array([[0, level, -deep - 0.02], [0, level, front], [0, high, front]])
    return tuple(pipe(_BACK, path + xyz(x, 0.0, 0.0), THIN) for x in (-side, side))
