"""How training tells where it is: a bar on a terminal, a line for each epoch elsewhere."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import typer
from rich.console import Console

from meshshard_train.loop import Progress
from meshshard_train.metrics import judged


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
                name, value = judged(progress.metrics)
                validation = f", {name} {100 * value:.1f} %"
            done = progress.epoch * meshes + progress.meshes
            what = f"epoch {progress.epoch + 1}/{epochs}, loss {progress.loss:.3f}, rate {progress.learning_rate:.1e}"
            bar.update(task, completed=done, description=what + validation)

        yield tell


def _print_epoch(progress: Progress) -> None:
    if progress.metrics:
        row = progress.metrics
        name, value = judged(row)
        typer.echo(
            f"epoch {row['epoch']}  loss {row['loss']:.4f}  rate {row['learning_rate']:.2e}  "
            f"{name} {100 * value:.2f} %  {row['seconds']:.1f} s",
            err=True,
        )
