"""meshshard reproduce: the paper's tables."""

import os
import shlex
from pathlib import Path
from typing import Annotated

import typer

from meshshard.errors import UsageError
from meshshard_train.commands.shared import Device, wait_quietly

DATA, SHARDS = "MESHSHARD_DATA", Path("SHARDS")


def reproduce(
    table: Annotated[
        str, typer.Argument(help="minicoseg, human, fewshot, features, normalisation, backbone, or shrec11.")
    ],
    line: Annotated[str | None, typer.Option(help="Only this line of the table, by its name on the page.")] = None,
    protocol: Annotated[str, typer.Option(help="honest, published, or both.")] = "both",
    seeds: Annotated[int, typer.Option(help="Of the honest protocol.", min=1)] = 3,
    published_seeds: Annotated[int, typer.Option(help="Of the published protocol.", min=1)] = 1,
    raw: Annotated[
        Path | None,
        typer.Option(help=f"Folder with the data sets' raw folders (default: ${DATA}, or ../shared/data)."),
    ] = None,
    work: Annotated[Path, typer.Option(help="Folder for shards and runs.")] = Path("data/reproduce"),
    out: Annotated[Path, typer.Option(help="Folder for records and pages.")] = Path("docs/results"),
    pages_only: Annotated[
        bool, typer.Option("--pages", help="Train nothing: write the pages from the records.")
    ] = False,
    compiling: Annotated[
        bool, typer.Option("--compile", help="Compile the networks that can be compiled first.")
    ] = False,
    device: Device = "auto",
) -> None:
    """Run an experiment of the paper, or go on with it, and write its page.

    A training that is recorded in OUT/runs is not done again; a stopped one goes on where it was. The page shows two
    protocols side by side: honest (chosen on validation) and published (chosen on test).

    Example: meshshard reproduce minicoseg --seeds 1 --work /tmp/work --out /tmp/results
    """
    wait_quietly()
    from meshshard import open_dataset
    from meshshard_train.card import hardware
    from meshshard_train.commands.runs import finished_run
    from meshshard_train.device import choose_device
    from meshshard_train.loading import Loading
    from meshshard_train.reproduce.experiments import TABLES
    from meshshard_train.reproduce.pages import write_pages
    from meshshard_train.reproduce.trials import PROTOCOLS, all_trials, record_of, shards_of, write_record
    from meshshard_train.tasks import task_of
    from meshshard_train.team import Team

    if table not in TABLES:
        raise UsageError(f"there is no table {table!r}: {', '.join(TABLES)}")
    if protocol not in (*PROTOCOLS, "both"):
        raise UsageError(f"--protocol {protocol!r}: honest, published, or both")
    chosen = [each for each in TABLES[table].lines if line in (None, each.name)]
    if not chosen:
        raise UsageError(
            f"--line {line!r}: the lines of {table} are {', '.join(e.name for e in TABLES[table].lines)}"
        )
    protocols = PROTOCOLS if protocol == "both" else (protocol,)
    trials = all_trials(chosen, protocols, {"honest": seeds, "published": published_seeds})
    where, root = choose_device(device), raw or Path(os.environ.get(DATA, "../shared/data"))
    for number, trial in enumerate([] if pages_only else trials, start=1):
        typer.echo(f"{number} of {len(trials)}: {trial.name}", err=True)
        if record_of(out, trial) is not None:
            typer.echo("recorded: not done again", err=True)
            continue
        shards = shards_of(trial, root, work / "features")
        dataset = open_dataset(shards)
        config, run = trial.config(task_of(dataset)), work / "runs" / trial.name
        if compiling and not config.pointwise:
            typer.echo("not compiled: its layers look at more than one vertex", err=True)
        made = finished_run(dataset, config, run, where, Loading(), Team(), False, compiling and config.pointwise)
        assert made is not None
        commands = [trial.prepare_command(Path(DATA), SHARDS), trial.train_command(config.task, SHARDS)]
        told = [f"meshshard {shlex.join(command)}" for command in commands]
        write_record(out, trial, dataset, made[0], told, hardware(where))
        write_pages(out)
    for path in write_pages(out):
        typer.echo(str(path))
