"""Outlines of the turned parts of a vase: lines of (radius, y), (P, 2), from `low` to `high`."""

import numpy as np
from jaxtyping import Float64
from scipy.interpolate import PchipInterpolator

Profile = Float64[np.ndarray, "P 2"]


def draw_base(rng: np.random.Generator, low: float, high: float, waist: float, widest: float) -> Profile:
    """A foot that ends in the `waist`: plinth, cone, or flared stem."""
    foot = max(rng.uniform(0.65, 0.95) * widest, waist + 0.04)
    shapes = (
        ([0.0, 1.0], [foot, foot]),
        ([0.0, 0.3, 1.0], [foot, foot, waist]),
        ([0.0, 0.25, 0.6, 1.0], [foot, 0.92 * foot, 0.85 * waist, waist]),
    )
    return _smooth(low, high, *shapes[rng.integers(len(shapes))])


def draw_body(
    rng: np.random.Generator, low: float, high: float, waist: float, widest: float, throat: float
) -> Profile:
    """A belly from the `waist` over the `widest` place to the `throat`: cones, bowls or drums."""
    middle = low + rng.uniform(0.3, 0.7) * (high - low)
    below, above = rng.choice([1.0, 1.4, 2.0, 2.6], size=2)
    lower = _quarter(waist, low, widest, middle, below)
    upper = _quarter(throat, high, widest, middle, above)[::-1]
    return np.concatenate([lower, upper[1:]])


def draw_neck(rng: np.random.Generator, low: float, high: float, throat: float) -> Profile:
    """A collar, a funnel, a trumpet or a bottle neck with a lip, above the `throat`."""
    lip = rng.uniform(1.3, 1.7) * throat
    shapes = (
        ([0.0, 0.7, 0.75, 1.0], [throat, throat, lip, lip]),
        ([0.0, 1.0], [throat, lip]),
        ([0.0, 0.3, 0.7, 1.0], [throat, 0.9 * throat, 1.05 * throat, lip]),
        ([0.0, 0.4, 0.8, 1.0], [throat, 0.85 * throat, 0.85 * throat, 1.15 * throat]),
    )
    return _smooth(low, high, *shapes[rng.integers(len(shapes))])


def _smooth(low: float, high: float, shares: list[float], radii: list[float]) -> Profile:
    """Monotone cubic through the radii at the shares of the height."""
    share = np.linspace(0, 1, 9)
    return np.column_stack([PchipInterpolator(shares, radii)(share), low + share * (high - low)])


def _quarter(radius: float, end: float, widest: float, middle: float, power: float) -> Profile:
    """Superellipse from (radius, end) to (widest, middle); power 1 is straight, 2 an ellipse."""
    angle = np.linspace(0, np.pi / 2, 7)
    out, along = np.sin(angle) ** (2 / power), np.cos(angle) ** (2 / power)
    return np.column_stack([radius + (widest - radius) * out, middle + (end - middle) * along])
