"""Lines over epochs, or over anything, as what an SVG needs."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from matplotlib.ticker import MaxNLocator

from meshshard.data_card.tables import shown

WIDTH, HEIGHT = 400, 240
LEFT, RIGHT, TOP, BOTTOM = 58, 12, 12, 44
"""Room around what is drawn, for numbers and the name of the axis."""

DASHES = ("none", "7 4", "2 3", "10 3 2 3")
"""Lines are told apart without colour; the colours are `--line-0` and so on of the page, as many."""

Number = float | int
Points = Sequence[tuple[Number, Number]]


@dataclass(frozen=True)
class Line:
    """A name, and points from left to right; those that are no finite numbers leave a gap."""

    name: str
    points: Points


def chart(
    title: str, across: str, lines: Sequence[Line], marks: Mapping[str, Number] | None = None
) -> dict[str, Any]:
    """What `chart` of `report.html` draws. `across`: name of the horizontal axis; `marks`: what stands where on it.

    Numbers on the axes are round; both begin and end with one. A chart without a finite number has no lines.
    """
    known = [[(x, y) for x, y in line.points if math.isfinite(x + y)] for line in lines]
    found = [point for points in known for point in points]
    if not found:
        return {"title": shown(title), "summary": f"{shown(title)}: no numbers", "lines": []}
    x_ticks = _ticks([x for x, _ in found])
    y_ticks = _ticks([y for _, y in found])
    return {
        "title": shown(title),
        "summary": "; ".join(
            _summary(title, across, line.name if len(lines) > 1 else "", points)
            for line, points in zip(lines, known, strict=True)
        ),
        "across": across,
        "width": WIDTH,
        "height": HEIGHT,
        "box": {"left": LEFT, "right": WIDTH - RIGHT, "top": TOP, "bottom": HEIGHT - BOTTOM},
        "x_ticks": [{"at": _across(x, x_ticks), "text": f"{x:g}"} for x in x_ticks],
        "y_ticks": [{"at": _up(y, y_ticks), "text": f"{y:g}"} for y in y_ticks],
        "marks": [{"at": _across(x, x_ticks), "text": text} for text, x in (marks or {}).items() if math.isfinite(x)],
        "lines": [
            {
                "name": shown(line.name),
                "number": number % len(DASHES),
                "dash": DASHES[number % len(DASHES)],
                "path": _path(line.points, x_ticks, y_ticks),
            }
            for number, line in enumerate(lines)
        ],
    }


def _ticks(values: Sequence[Number]) -> list[float]:
    low, high = min(values), max(values)
    if low == high:
        low, high = low - (abs(low) or 1) / 2, high + (abs(high) or 1) / 2
    whole = all(value == round(value) for value in values)
    ticks = MaxNLocator(nbins=5, steps=[1, 2, 2.5, 5, 10], integer=whole).tick_values(low, high)
    return [float(f"{tick:.12g}") for tick in ticks]


def _across(x: Number, ticks: Sequence[float]) -> str:
    return f"{LEFT + (x - ticks[0]) / (ticks[-1] - ticks[0]) * (WIDTH - LEFT - RIGHT):.1f}"


def _up(y: Number, ticks: Sequence[float]) -> str:
    return f"{HEIGHT - BOTTOM - (y - ticks[0]) / (ticks[-1] - ticks[0]) * (HEIGHT - TOP - BOTTOM):.1f}"


def _path(points: Points, x_ticks: Sequence[float], y_ticks: Sequence[float]) -> str:
    """An SVG path that begins anew after a gap; a point alone is a short stroke."""
    parts: list[list[str]] = [[]]
    for x, y in points:
        if math.isfinite(x + y):
            parts[-1].append(f"{_across(x, x_ticks)} {_up(y, y_ticks)}")
        elif parts[-1]:
            parts.append([])
    return "".join(f"M{'L'.join(part if len(part) > 1 else part * 2)}" for part in parts if part)


def _summary(title: str, across: str, name: str, points: Points) -> str:
    what = shown(f"{title}, {name}" if name else title)
    if not points:
        return f"{what}: no numbers"
    values = [y for _, y in points]
    ends = f"from {values[0]:.3g} at {across} {points[0][0]:g} to {values[-1]:.3g} at {points[-1][0]:g}"
    return f"{what}: {ends}, least {min(values):.3g}, most {max(values):.3g}"
