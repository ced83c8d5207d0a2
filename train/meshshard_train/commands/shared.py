"""What the verbs share: options, and the table of results."""

import os
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.box import SIMPLE_HEAD
from rich.console import Console, JustifyMethod
from rich.table import Table
from rich.text import Text

Device = Annotated[str, typer.Option(help="auto, cpu or cuda.")]
Run = Annotated[Path, typer.Argument(help="Folder of a run.")]


def wait_quietly() -> None:
    """Let threads that wait for each other sleep after a short while, before torch is imported: they spin for long
    otherwise, and training beside anything else that computes is several times slower. Sleeping at once costs half
    the speed of an idle machine. Whoever set GOMP_SPINCOUNT or OMP_WAIT_POLICY keeps it."""
    if "OMP_WAIT_POLICY" not in os.environ:
        os.environ.setdefault("GOMP_SPINCOUNT", "10000")


def print_results(results: dict[str, Any]) -> None:
    """What results are, their table, and that of the classes of the last split, on a terminal of 80 columns."""
    from meshshard_train import matching_results
    from meshshard_train.tables import about, class_table, main_table, not_trained

    console = Console()
    if results["task"] == "correspondence":
        _print_table(console, matching_results.about(results), matching_results.matching_table(results))
        return
    _print_table(console, about(results), main_table(results))
    if missing := results.get("classes_not_trained"):
        console.print(Text(not_trained(missing)))
    split = list(results["rows"])[-1]
    title = f"{split}, each class, per cent; {results['protocol']}"
    _print_table(console, title, class_table(results, split, ("accuracy", "iou", "dice")))


def _print_table(console: Console, title: str, rows: list[list[str]]) -> None:
    head, *rest = rows
    table = Table(box=SIMPLE_HEAD, pad_edge=False)
    for number, name in enumerate(head):
        justify: JustifyMethod = "right" if number else "left"
        table.add_column(Text("\n".join(name.rsplit(" ", 1))), justify=justify, overflow="fold")
    for row in rest:
        table.add_row(*map(Text, row))  # not markup: a name may stand in brackets
    console.print(Text(title), table)
