"""A run from its start to its results, alone or by a team."""

from contextlib import ExitStack
from pathlib import Path
from typing import Any

import torch
import typer

from meshshard import Dataset
from meshshard.files import lock_folder
from meshshard_train.commands.progress import progress_bar
from meshshard_train.config import TrainConfig
from meshshard_train.loading import Loading
from meshshard_train.loop import Progress, train
from meshshard_train.members import classes_without, training_numbers
from meshshard_train.results import write_results
from meshshard_train.tables import not_trained
from meshshard_train.team import Team


def finished_run(
    dataset: Dataset,
    config: TrainConfig,
    run: Path,
    device: torch.device,
    loading: Loading,
    team: Team,
    tensorboard: bool,
    compiling: bool,
) -> tuple[dict[str, Any], list[Path]] | None:
    """Train, or go on, and evaluate: what results.json says, and the pictures. The first process of a team holds the
    folder, writes and tells; the others get None. UsageError as `train`, or another program holds the folder."""
    if not team.leads:
        train(dataset, config, run, device, loading=loading, team=team, compiling=compiling)
        return None
    with ExitStack() as stack:
        stack.enter_context(lock_folder(run))
        numbers = training_numbers(dataset, config)
        if missing := classes_without(dataset, numbers, config.task):
            typer.echo(not_trained(missing), err=True)
        told = [stack.enter_context(progress_bar(config.epochs, config.passes * len(numbers)))]
        if tensorboard:
            from meshshard_train.events import Events

            events = Events(run)
            stack.callback(events.close)
            told.append(events)

        def report(progress: Progress) -> None:
            for tell in told:
                tell(progress)

        history = train(dataset, config, run, device, report, loading, team, compiling)
        return write_results(dataset, run, history, device, loading)
