"""What is to be done for a page, by one thread, the most urgent first."""

from collections.abc import Iterator
from threading import Condition


class Todo:
    """Kinds of work, the most urgent first, each an iterator that does a bit of it at every step. Whoever wants work
    of a kind replaces what is left of the former one, so that nobody waits for what nobody looks at any more."""

    def __init__(self, *kinds: str) -> None:
        self._wanted: dict[str, Iterator[None] | None] = dict.fromkeys(kinds)
        self._changed = Condition()

    def want(self, kind: str, steps: Iterator[None]) -> None:
        """From any thread; returns at once."""
        with self._changed:
            assert kind in self._wanted, kind
            self._wanted[kind] = steps
            self._changed.notify()

    def step(self) -> None:
        """Do the next bit of the most urgent work; wait where there is none. What a bit raises ends its work."""
        with self._changed:
            while not (waiting := [(kind, steps) for kind, steps in self._wanted.items() if steps is not None]):
                self._changed.wait()
        kind, steps = waiting[0]
        try:
            next(steps)
        except BaseException as end:
            with self._changed:
                if self._wanted[kind] is steps:
                    self._wanted[kind] = None
            if not isinstance(end, StopIteration):
                raise
