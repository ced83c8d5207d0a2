"""meshshard train: a folder of shards to a run."""

from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer

from meshshard.commands import AsJson, Data, locate
from meshshard.errors import UsageError
from meshshard.plain import print_table, to_json
from meshshard_train.commands.shared import Device, print_results, wait_quietly
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
    scaling: Annotated[str | None, typer.Option(help="log-standard, log-area or min-max.")] = None,
    rotation_axes: Annotated[str | None, typer.Option(help="Axes of quarter turns, as xyz, y, or none.")] = None,
    batch_vertices: Annotated[int | None, typer.Option(help="Vertices packed into a step.")] = None,
    train_fraction: Annotated[
        str | None, typer.Option(help="Share of train to learn from, few-shot: 0.01 or 1/100.")
    ] = None,
    precision: Annotated[str | None, typer.Option(help="auto, bf16 or fp32.")] = None,
    seed: Annotated[int | None, typer.Option(help="Decides weights, order and augmentation.", min=0)] = None,
    seeds: Annotated[
        int | None, typer.Option(help="Train from so many seeds, into RUN/seed-N each; mean and deviation.", min=1)
    ] = None,
    workers: Annotated[int, typer.Option(help="Processes that read shards, when they do not fit.", min=0)] = 0,
    start_method: Annotated[
        str | None, typer.Option(help="How they start: fork, spawn or forkserver (default: Python's).")
    ] = None,
    keep_gib: Annotated[float, typer.Option(help="Data up to this size stays on the device.", min=0)] = 4.0,
    tensorboard: Annotated[bool, typer.Option("--tensorboard", help="Write RUN/tensorboard too.")] = False,
    compiling: Annotated[
        bool, typer.Option("--compile", help="Compile the network first, in minutes: faster steps, other rounding.")
    ] = False,
    device: Device = "auto",
    as_json: AsJson = False,
) -> None:
    """Train the network on a folder of shards, show a table, and name its pictures.

    Stopped at any time and called again, it goes on where it was. The epoch and the voting rounds are chosen on the
    validation split, and the test split is looked at once, at the end; recipe official chooses on the test split.

    Examples: meshshard train minicoseg --epochs 30

    torchrun --nproc-per-node 2 -m -- meshshard train minicoseg
    """
    wait_quietly()
    from meshshard import open_dataset  # torch takes a second to import: it stays out of --help
    from meshshard_train.commands.runs import finished_run
    from meshshard_train.loading import Loading
    from meshshard_train.loop import SAVE_SECONDS
    from meshshard_train.results import RESULTS
    from meshshard_train.seeds import SEEDS, about, folder_of, table_rows, write_seeds
    from meshshard_train.settings import resolved
    from meshshard_train.tasks import check_task, task_of
    from meshshard_train.team import joined

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
    with joined(device) as (team, where):
        dataset = open_dataset(locate(data))
        chosen = resolved(recipe, task_of(dataset), config, settings or [], named)
        check_task(dataset, chosen)
        place = run or RUNS / (dataset.name if recipe == "paper" else f"{dataset.name}-{recipe}")
        loading = Loading(keep_gib=keep_gib, workers=workers, start_method=start_method)
        configs = {place: chosen}
        if seeds is not None:
            every = range(chosen.seed, chosen.seed + seeds)
            configs = {folder_of(place, seed): replace(chosen, seed=seed) for seed in every}
        try:
            made = [
                finished_run(dataset, c, r, where, loading, team, tensorboard, compiling) for r, c in configs.items()
            ]
        except KeyboardInterrupt:
            raise UsageError(
                "stopped; the same command goes on where it was saved last, "
                f"at most {SAVE_SECONDS / 60:.0f} minutes of training before"
            ) from None
    finished = [one for one in made if one is not None]
    if not finished:  # a team's first process tells
        return
    if seeds is not None:
        summary = write_seeds(place, [results for results, _ in finished])
        written = [place / "seeds.md", place / SEEDS]
    else:
        summary, pictures = finished[0]
        written = [*pictures, place / RESULTS]
    if as_json:
        typer.echo(to_json(summary))
        return
    if seeds is None:
        print_results(summary)
    else:
        head, *rows = table_rows(summary)
        typer.echo(about(summary))
        print_table(head, rows)
    for path in written:
        typer.echo(str(path))
