"""A plot of one vertex's heat kernel signature over time, beside the mesh's mean."""

import numpy as np
import viser

from meshshard.palette import class_colour
from meshshard.sample import Sample
from meshshard.view.words import block

LOGARITHMIC: viser.uplot.Scale = {"time": False, "distr": 3}  # `time`: whether numbers are dates
HINT = block("Click a vertex: its heat kernel signature over time is plotted here.")


class Plot:
    """Empty until a vertex is shown."""

    def __init__(self, gui: viser.GuiApi) -> None:
        self._text = gui.add_html(HINT)
        one = np.ones(2)
        self._chart = gui.add_uplot(
            (one, one, one),
            series=(
                {"label": "t"},
                {"label": "vertex", "stroke": class_colour(0), "width": 2},
                {"label": "mean", "stroke": class_colour(1), "width": 2, "dash": (6, 4)},
            ),
            scales={"x": LOGARITHMIC, "y": LOGARITHMIC},
            axes=({"label": "time t, squared radii"}, {"label": "HKS, 1 / squared radii", "size": 60}),
            height=260,
            padding=(12, 24, 0, 0),
            visible=False,
        )

    def clear(self) -> None:
        """Nothing is chosen."""
        self._text.content, self._chart.visible = HINT, False

    def show(self, sample: Sample, vertex: int, words: str) -> None:
        """The curve of a vertex, under some words, HTML, that say which it is. A vertex of faces without area alone
        has no curve."""
        used = sample.used_vertices
        self._text.content = words if used[vertex] else words + block("It has no features.")
        if used[vertex]:
            mean = sample.hks[used].mean(axis=0, dtype=np.float64)
            self._chart.data = (sample.times, sample.hks[vertex].astype(np.float64), mean)
        self._chart.visible = bool(used[vertex])
