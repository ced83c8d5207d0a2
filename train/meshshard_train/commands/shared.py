"""What the verbs share: options, and the table of results."""

import os
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

Device = Annotated[str, typer.Option(help="auto, cpu or cuda.")]
Run = Annotated[Path, typer.Argument(help="Folder of a run.")]


def wait_quietly() -> None:
    """Let threads that wait for each other sleep, before torch is imported: they spin otherwise, and training beside
    anything else that computes is several times slower. Whoever set OMP_WAIT_POLICY keeps it."""
    os.environ.setdefault("OMP_WAIT_POLICY", "passive")


def print_results(results: dict[str, Any]) -> None:
    """The table of results.json on a terminal."""
    from meshshard_train.results import table_rows

    head, *rows = table_rows(results)
    table = Table(
        *head, title=f"{results['dataset']}, epoch {results['epoch']}, % ({results['voting_rounds']} rounds)"
    )
    for row in rows:
        table.add_row(*row)
    Console().print(table)
