"""How training tells where it is: a bar on a terminal, a line for each epoch elsewhere."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import typer
from rich.console import Console

from meshshard_train.loop import Progress


@contextmanager
def progress_bar(epochs: int, meshes: int) -> Iterator[Callable[[Progress], None]]:
    """A bar over all epochs on a terminal; a line for each epoch elsewhere."""
    if not sys.stderr.isatty():
        yield _print_epoch
        return
    from rich.progress import BarColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
    from rich.progress import Progress as Bar

    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn(), TimeRemainingColumn())
    with Bar(*columns, console=Console(stderr=True)) as bar:
        task = bar.add_task("starting", total=epochs * meshes)
        validation = ""

        def tell(progress: Progress) -> None:
            nonlocal validation
            if progress.metrics:
                validation = f", {_judged(progress.metrics)}"
            done = progress.epoch * meshes + progress.meshes
            what = f"epoch {progress.epoch + 1}/{epochs}, loss {progress.loss:.3f}, rate {progress.learning_rate:.1e}"
            bar.update(task, completed=done, description=what + validation)

        yield tell


def _print_epoch(progress: Progress) -> None:
    if progress.metrics:
        row = progress.metrics
        typer.echo(
            f"epoch {row['epoch']}  loss {row['loss']:.4f}  rate {row['learning_rate']:.2e}  "
            f"{_judged(row)}  {row['seconds']:.1f} s",
            err=True,
        )


def _judged(row: dict[str, Any]) -> str:
    """The first figure of the split that chooses."""
    name = next(name for name in row if name.startswith(("val_", "test_")))
    return f"{name.replace('_', ' ')} {100 * row[name]:.2f} %"
