"""The page: which mesh is looked at, how it is coloured, what is said of it. One thread does what controls ask."""

import math
from collections.abc import Iterator
from contextlib import suppress
from functools import lru_cache
from html import escape
from itertools import pairwise

import numpy as np
import viser
from jaxtyping import UInt8

from meshshard.dataset import Dataset
from meshshard.errors import MeshshardError
from meshshard.render import png_bytes, render
from meshshard.sample import Sample
from meshshard.view.colouring import ERRORS, NOTHING, PREDICTION, Classes, Coloured, choices, coloured
from meshshard.view.listing import LARGEST, STORED, WORST, Listing
from meshshard.view.opinion import Judge, Opinion, labelled_element
from meshshard.view.plot import Plot
from meshshard.view.stage import Stage
from meshshard.view.strip import SIZE, Strip
from meshshard.view.todo import Todo
from meshshard.view.words import block, of_corner, of_mesh

RANKED_EVERY = 100
"""Meshes are judged before the list is put in order again."""

READABLE = "<style>label { color: var(--mantine-color-text) }</style>"
"""Names of controls as dark as other words; viser has them in a grey of 3.3 to 1 on white."""

PATIENCE = 60.0
"""Seconds that a browser may take to draw a picture that is saved."""

Picture = UInt8[np.ndarray, "height width 4"]


class Page:
    """Controls of a page and what they do. `judge`: a network whose opinions are shown too. UsageError: there is no
    mesh to look at."""

    def __init__(self, server: viser.ViserServer, dataset: Dataset, judge: Judge | None) -> None:
        self._dataset, self._judge = dataset, judge
        self._todo = Todo("save", "mark", "draw", "strip", "judge")
        self._scores: dict[int, float] = {}
        self._drawn: tuple[int, Sample] | None = None
        self._opinion = lru_cache(maxsize=64)(self._opinion_of)
        self._picture = lru_cache(maxsize=512)(self._picture_of)
        known = judge or dataset.index
        self._classes = Classes(known.classes, known.colours)
        gui = server.gui
        gui.set_panel_label(f"{judge.name}: {dataset.name}" if judge else dataset.name)
        orders = (*[WORST] * bool(judge), STORED, LARGEST)
        self._strip = Strip(gui, Listing(dataset), orders, self._choose, self._list)
        self._stage = Stage(server, lambda *hit: self._todo.want("mark", self._mark(*hit)))
        self._controls(gui)
        self._list()
        self._choose(0)
        if judge:
            self._todo.want("judge", self._judge_all(judge))

    def work(self) -> None:
        """Do what is asked for, without end. What is wrong with a mesh or a file is said on the page."""
        while True:
            try:
                self._todo.step()
            except (MeshshardError, OSError) as error:
                self._said.content = block(f'<b role="alert" style="color:#E03131">{escape(str(error))}</b>')

    def _controls(self, gui: viser.GuiApi) -> None:
        ways = choices(bool(self._dataset.classes), self._judge is not None)
        self._facts, self._said = gui.add_html(""), gui.add_html("")
        gui.add_html(READABLE)
        step = gui.add_button_group("mesh", ("previous", "next"))
        self._what = gui.add_dropdown("colour", ways)
        beside = PREDICTION if self._judge else NOTHING
        self._beside = gui.add_dropdown("beside it", (NOTHING, *ways), initial_value=beside)
        self._log_times = np.log10(self._dataset.recipe.times)
        low, high = float(self._log_times[0]), float(self._log_times[-1])
        self._time = gui.add_slider(
            "HKS: log10 t",
            low,
            high,
            min((b - a for a, b in pairwise(self._log_times.tolist())), default=1.0),
            low,
            marks=((low, f"t = {10**low:.3g}"), (high, f"{10**high:.3g}")),
            hint="Diffusion time t of the heat kernel signature, in squared radii of the mesh",
        )
        self._wires, dark = gui.add_checkbox("wireframe", False), gui.add_checkbox("dark", False)
        save = gui.add_button("Save PNG")
        self._legend = gui.add_html("")
        self._plot = Plot(gui)
        gui.main_panel.dock_right()
        for control in (self._what, self._beside, self._time, self._wires):
            control.on_update(lambda _: self._todo.want("draw", self._draw()))
        for control in (self._what, self._beside, self._time):
            control.on_update(lambda _: self._list())

        def paint(_: object = None) -> None:
            gui.configure_theme(dark_mode=dark.value, show_logo=False, show_share_button=False)

        dark.on_update(paint)
        paint()
        step.on_click(lambda event: self._go(1 if event.target.value == "next" else -1))
        save.on_click(lambda event: self._todo.want("save", self._save(event.client)))

    def _list(self) -> None:
        self._todo.want("strip", self._strip.steps(self._scores, self._thumbnail))

    def _choose(self, number: int) -> None:
        self._number = number
        self._todo.want("draw", self._draw())

    def _go(self, places: int) -> None:
        """On to the next mesh of the list, or back; from a mesh that is not in it, to its first."""
        found = self._strip.found(self._scores)
        if found:
            here = found.index(self._number) + places if self._number in found else 0
            self._choose(found[here % len(found)])

    def _opinion_of(self, number: int) -> Opinion | None:
        return next(self._judge.opinions([number])) if self._judge else None

    def _coloured(self, what: str, number: int, sample: Sample) -> Coloured:
        opinion = self._opinion(number) if what in (PREDICTION, ERRORS) else None
        return coloured(what, sample, self._time_number, self._element(sample), self._classes, opinion)

    def _element(self, sample: Sample) -> str:
        return self._judge.element if self._judge else labelled_element(sample)

    @property
    def _time_number(self) -> int:
        return int(np.abs(self._log_times - self._time.value).argmin())

    def _draw(self) -> Iterator[None]:
        number = self._number
        before, drawn = self._drawn or (None, None)
        sample = drawn if drawn and number == before else self._dataset[number]
        drawings = [self._coloured(what, number, sample) for what in self._ways]
        if self._stage.show(sample, drawings, self._wires.value):
            self._plot.clear()
        self._drawn = number, sample
        legends = zip(self._ways, drawings, strict=True)
        self._legend.content = "".join(block(f"<b>{what}</b>{drawing.legend}") for what, drawing in legends)
        self._facts.content = of_mesh(self._dataset, number, sample, self._judge, self._opinion(number))
        self._said.content = ""
        yield

    def _mark(self, sample: Sample, face: int, vertex: int) -> Iterator[None]:
        number, drawn = self._drawn or (0, None)
        if sample is drawn:  # not one that was clicked while the next one came
            words = of_corner(sample, face, vertex, self._element(sample), self._classes, self._opinion(number))
            self._stage.mark(vertex)
            self._plot.show(sample, vertex, words)
        yield

    def _thumbnail(self, number: int) -> Picture:
        return np.hstack([self._picture(number, what, self._time_number) for what in self._ways])

    def _picture_of(self, number: int, what: str, _: int) -> Picture:
        sample = self._dataset[number]
        colours = self._coloured(what, number, sample).corners(sample.faces)
        return render(sample.vertices, sample.faces, colours, size=SIZE)

    @property
    def _ways(self) -> list[str]:
        """What the mesh is coloured by, once or twice."""
        return [way.value for way in (self._what, self._beside) if way.value != NOTHING]

    def _judge_all(self, judge: Judge) -> Iterator[None]:
        for number, opinion in enumerate(judge.opinions(range(len(self._dataset)))):
            if not math.isnan(opinion.score):
                self._scores[number] = opinion.score
            if number % RANKED_EVERY == 0:
                self._list()
            yield
        self._list()

    def _save(self, client: viser.ClientHandle | None) -> Iterator[None]:
        assert client is not None  # a button is pressed in a browser
        height, width = client.camera.image_height, client.camera.image_width
        with suppress(RuntimeError):  # the browser is gone
            picture = client.get_render(height, width, transport_format="png", timeout=PATIENCE)
            name = self._dataset.ids[self._number].replace("/", "_")
            client.send_file_download(f"{name}.png", png_bytes(picture), save_immediately=True)
        yield
