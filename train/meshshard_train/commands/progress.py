"""How training tells where it is: a bar on a terminal, a line for each epoch elsewhere."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import typer
from rich.console import Console
from rich.progress import BarColumn, TextColumn, TimeRemainingColumn
from rich.progress import Progress as Bar

from meshshard_train.loop import Progress
from meshshard_train.metrics import judged


@contextmanager
def progress_bar(epochs: int, meshes: int) -> Iterator[Callable[[Progress], None]]:
    """What to call with where training is. A terminal gets a bar over all epochs with the epoch, loss, learning rate,
    meshes a second and time left; others get a line for each epoch."""
    if not sys.stderr.isatty():
        yield _Lines()
        return
    columns = (TextColumn("{task.description}"), BarColumn(), TimeRemainingColumn(compact=True))
    with Bar(*columns, console=Console(stderr=True)) as bar:
        yield _OnBar(bar, epochs, meshes)


class _Lines:
    """Prints the rows that are new since the first call."""

    def __init__(self) -> None:
        self.told = -1

    def __call__(self, progress: Progress) -> None:
        for row in progress.history[self.told :] if self.told >= 0 else ():
            typer.echo(epoch_line(row), err=True)
        self.told = len(progress.history)


class _OnBar:
    def __init__(self, bar: Bar, epochs: int, meshes: int) -> None:
        self.bar, self.epochs, self.meshes = bar, epochs, meshes

    def __call__(self, progress: Progress) -> None:
        done = progress.epoch * self.meshes + progress.meshes
        if not self.bar.tasks:  # what was done before counts for nothing in the time left
            self.bar.add_task("", total=self.epochs * self.meshes, completed=done)
        task = self.bar.tasks[0]
        parts = [f"epoch {min(progress.epoch + 1, self.epochs)}/{self.epochs}", f"loss {progress.loss:.3f}"]
        parts += [f"rate {progress.learning_rate:.1e}", f"{task.speed or 0:.0f} meshes/s"]
        if progress.history:
            parts.append(_judged(progress.history[-1]))
        self.bar.update(task.id, completed=done, description=", ".join(parts))


def epoch_line(row: dict[str, Any]) -> str:
    """A row of metrics.jsonl for people."""
    head = f"epoch {row['epoch']}  loss {row['loss']:.4f}  rate {row['learning_rate']:.2e}"
    return "  ".join([head, _judged(row), f"{row['seconds']:.1f} s"])


def _judged(row: dict[str, Any]) -> str:
    name, value = judged(row)
    figure, sign, protocol = name.partition(" (")
    return f"{figure} {100 * value:.2f} %{sign}{protocol}"
