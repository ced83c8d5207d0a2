"""How far a run is: a bar on a terminal, a line every ten seconds elsewhere."""

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Protocol

import typer


class Tell(Protocol):
    """Told after each mesh that was computed: how many are done, of how many, and how many are not stored."""

    def __call__(self, done: int, total: int, rejected: int) -> None: ...


@contextmanager
def progress(name: str) -> Iterator[Tell]:
    """A bar on a terminal, a line every ten seconds elsewhere."""
    if not sys.stderr.isatty():
        yield _Lines(name)
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[rate]:.1f} meshes/s"),
        TimeRemainingColumn(),
        TextColumn("{task.fields[rejected]} not stored"),
    )
    with Progress(*columns, console=Console(stderr=True)) as bar:
        task = bar.add_task(name, total=None, rejected=0, rate=0.0)
        start = time.perf_counter()

        def tell(done: int, total: int, rejected: int) -> None:
            rate = done / (time.perf_counter() - start)
            bar.update(task, completed=done, total=total, rejected=rejected, rate=rate)

        yield tell


class _Lines:
    """Progress for logs."""

    def __init__(self, name: str) -> None:
        self.name, self.start = name, time.perf_counter()
        self.next = self.start + 10

    def __call__(self, done: int, total: int, rejected: int) -> None:
        now = time.perf_counter()
        if now >= self.next:
            self.next = now + 10
            rate = done / (now - self.start)
            typer.echo(
                f"{self.name}: {done} of {total}, {rate:.1f} meshes/s, {(total - done) / rate:.0f} s left, "
                f"{rejected} not stored",
                err=True,
            )
