"""What the verbs share: options, and the table of results."""

from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

Device = Annotated[str, typer.Option(help="auto, cpu or cuda.")]
Run = Annotated[Path, typer.Argument(help="Folder of a run.")]


def print_results(results: dict[str, Any]) -> None:
    """The table of results.json on a terminal."""
    from meshshard_train.matching_results import about, matching_table
    from meshshard_train.results import table_rows

    if results["task"] == "correspondence":
        (head, *rows), title = matching_table(results), about(results)
    else:
        head, *rows = table_rows(results)
        title = f"{results['dataset']}, epoch {results['epoch']}, % ({results['voting_rounds']} rounds)"
    table = Table(*head, title=title)
    for row in rows:
        table.add_row(*row)
    Console().print(table)
