"""meshshard train: a folder of shards to a run."""

from pathlib import Path
from typing import Annotated, Any

import typer

from meshshard.commands import Data, locate
from meshshard.errors import UsageError
from meshshard_train.commands.shared import Device, print_results
from meshshard_train.recipes import RECIPES

RUNS = Path("runs")


def train(
    data: Data,
    run: Annotated[
        Path | None, typer.Option(help="Folder of the run (default: runs/NAME, and -RECIPE unless paper).")
    ] = None,
    recipe: Annotated[str, typer.Option(help=f"Training recipe: {', '.join(RECIPES)}.")] = "paper",
    config: Annotated[Path | None, typer.Option(help="TOML file with settings, as learning_rate = 1e-3.")] = None,
    settings: Annotated[
        list[str] | None, typer.Option("--set", help="Any setting, as NAME=VALUE; may be repeated.")
    ] = None,
    epochs: Annotated[int | None, typer.Option(help="Length of the schedule.")] = None,
    learning_rate: Annotated[float | None, typer.Option(help="Highest learning rate.")] = None,
    features: Annotated[str | None, typer.Option(help="Input features, separated by commas.")] = None,
    scaling: Annotated[str | None, typer.Option(help="log-standard or min-max.")] = None,
    rotation_axes: Annotated[str | None, typer.Option(help="Axes of quarter turns, as xyz, y, or none.")] = None,
    batch_vertices: Annotated[int | None, typer.Option(help="Vertices packed into a step.")] = None,
    train_fraction: Annotated[
        str | None, typer.Option(help="Share of train to learn from, few-shot: 0.01 or 1/100.")
    ] = None,
    precision: Annotated[str | None, typer.Option(help="auto, bf16 or fp32.")] = None,
    seed: Annotated[int | None, typer.Option(help="Decides weights, order and augmentation.", min=0)] = None,
    workers: Annotated[int, typer.Option(help="Processes that read shards, when they do not fit.", min=0)] = 0,
    keep_gib: Annotated[float, typer.Option(help="Data up to this size stays on the device.", min=0)] = 4.0,
    device: Device = "auto",
) -> None:
    """Train the network on a folder of shards, show a table, and name its pictures.

    Stopped at any time and called again, it goes on where it was. The epoch and the voting rounds are chosen on the
    validation split; the test split is looked at once, at the end.

    Example: meshshard train minicoseg --epochs 30
    """
    folder = locate(data)
    from meshshard import open_dataset  # torch takes a second to import: it stays out of --help
    from meshshard.files import lock_folder
    from meshshard_train.commands.progress import progress_bar
    from meshshard_train.device import choose_device
    from meshshard_train.loading import Loading
    from meshshard_train.loop import train as run_training
    from meshshard_train.members import classes_without, training_numbers
    from meshshard_train.results import write_results
    from meshshard_train.settings import resolved
    from meshshard_train.tasks import check_task, task_of

    dataset = open_dataset(folder)
    named: dict[str, Any] = {
        "epochs": epochs,
        "learning_rate": learning_rate,
        "features": features,
        "scaling": scaling,
        "rotation_axes": rotation_axes,
        "batch_vertices": batch_vertices,
        "train_fraction": train_fraction,
        "precision": precision,
        "seed": seed,
    }
    chosen = resolved(recipe, task_of(dataset), config, settings or [], named)
    check_task(dataset, chosen)
    numbers = training_numbers(dataset, chosen)
    if missing := classes_without(dataset, numbers, chosen.task):
        typer.echo(f"no training mesh has {', '.join(missing)}: these classes cannot be learned", err=True)
    place = run or RUNS / (dataset.name if recipe == "paper" else f"{dataset.name}-{recipe}")
    where, loading = choose_device(device), Loading(keep_gib=keep_gib, workers=workers)
    try:
        with lock_folder(place), progress_bar(chosen.epochs, len(numbers)) as tell:
            history = run_training(dataset, chosen, place, where, tell, loading)
            results, pictures = write_results(dataset, place, history, where, loading)
    except KeyboardInterrupt:
        raise UsageError("stopped; the same command goes on after the last whole epoch") from None
    print_results(results)
    for path in (*pictures, place / "results.json"):
        typer.echo(str(path))
