"""How far prediction is."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console


@contextmanager
def mesh_bar(meshes: int) -> Iterator[Callable[[], None]]:
    """A bar on a terminal, told after each mesh; lines that are printed meanwhile go above it."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    above = sys.stdout.isatty()
    console = Console(stderr=not above)
    columns = (TextColumn("labelled"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, disable=not console.is_terminal, redirect_stdout=above) as bar:
        task = bar.add_task("", total=meshes)
        yield lambda: bar.advance(task)
