"""The list of meshes beside the scene: found by words, ordered, a page of thumbnails at a time."""

from collections.abc import Callable, Iterator, Mapping
from functools import partial

import numpy as np
import viser
from jaxtyping import UInt8

from meshshard.view.listing import Listing
from meshshard.view.words import block, end_of

ROWS, SIZE, WIDTH = 6, 104, 250
"""Thumbnails of a page, their pixels, and those of the panel across."""

LETTERS = 26
"""That fit on a button, with a score or without."""

NO_PICTURE = np.zeros((SIZE, SIZE, 4), dtype=np.uint8)


class Strip:
    """Its controls, and a button with a picture for each mesh of a page. `chosen` is called with the number of a mesh
    whose button is pressed, `changed` when another page is to be filled by `steps`."""

    def __init__(
        self,
        gui: viser.GuiApi,
        listing: Listing,
        orders: tuple[str, ...],
        chosen: Callable[[int], None],
        changed: Callable[[], None],
    ) -> None:
        self._listing, self._chosen, self._changed = listing, chosen, changed
        self._numbers: list[int] = []
        panel = gui.add_panel()
        with panel.add_tab("Meshes"):
            self._text = gui.add_text("find", "", hint="Words of the id and the split, as: test chair")
            self._order = gui.add_dropdown("order", orders)
            self._page = gui.add_slider("page", 1, 1, 1, 1)
            self._count = gui.add_html("")
            self._rows = [(gui.add_button("", visible=False), gui.add_image(NO_PICTURE)) for _ in range(ROWS)]
        panel.dock_left()
        panel.set_width(WIDTH)
        self._page.on_update(lambda _: changed())
        for control in (self._text, self._order):
            control.on_update(self._restart)
        for place, (button, _) in enumerate(self._rows):
            button.on_click(partial(self._pressed, place))

    def _restart(self, _: object) -> None:
        self._page.value = 1  # type: ignore[misc]  # its setter has a decorator that mypy does not know
        self._changed()

    def _pressed(self, place: int, _: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
        if place < len(self._numbers):
            self._chosen(self._numbers[place])

    def found(self, scores: Mapping[int, float]) -> list[int]:
        """Numbers of all meshes that are listed, in order."""
        return self._listing.find(self._text.value, self._order.value, scores)

    def steps(
        self, scores: Mapping[int, float], picture: Callable[[int], UInt8[np.ndarray, "height width 4"]]
    ) -> Iterator[None]:
        """Fill the page: names at first, then a picture a step."""
        found = self.found(scores)
        self._page.max = max(1, -(-len(found) // ROWS))
        start, before = (self._page.value - 1) * ROWS, self._numbers
        self._numbers = found[start : start + ROWS]
        self._count.content = block(f"{len(found):,} of {len(self._listing.names):,} meshes")
        for place, (button, image) in enumerate(self._rows):
            button.visible = image.visible = place < len(self._numbers)
            if image.visible:
                button.label = self._label(self._numbers[place], scores)
            if self._numbers[place : place + 1] != before[place : place + 1]:
                image.image = NO_PICTURE
        yield
        for number, (_, image) in zip(list(self._numbers), self._rows, strict=False):
            image.image = picture(number)
            yield

    def _label(self, number: int, scores: Mapping[int, float]) -> str:
        score = f"{100 * scores[number]:.1f} % · " if number in scores else ""
        return score + end_of(self._listing.names[number], LETTERS - len(score))
