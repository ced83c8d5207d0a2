"""The verbs of the training half: train, evaluate, predict."""

import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

from meshshard.commands import AsJson, Data, locate
from meshshard.errors import UsageError
from meshshard.plain import to_json
from meshshard_train.config import RECIPES, TASKS

if TYPE_CHECKING:  # torch takes a second to import: it stays out of --help
    from collections.abc import Callable

    from meshshard_train.loop import Progress

RUNS = Path("runs")
Device = Annotated[str, typer.Option(help="auto, cpu or cuda.")]
Run = Annotated[Path, typer.Argument(help="Folder of a run.")]


def train(
    data: Data,
    run: Annotated[Path | None, typer.Option(help="Folder of the run (default: runs/NAME).")] = None,
    recipe: Annotated[str, typer.Option(help=f"Training recipe: {', '.join(RECIPES)}.")] = "paper",
    epochs: Annotated[int | None, typer.Option(help="Length of the schedule.")] = None,
    learning_rate: Annotated[float | None, typer.Option(help="Highest learning rate.")] = None,
    features: Annotated[str | None, typer.Option(help="Input features, separated by commas.")] = None,
    scaling: Annotated[str | None, typer.Option(help="log-standard or min-max.")] = None,
    rotation_axes: Annotated[str | None, typer.Option(help="Axes of quarter turns, as xyz, y, or none.")] = None,
    batch_vertices: Annotated[int | None, typer.Option(help="Vertices packed into a step.")] = None,
    precision: Annotated[str | None, typer.Option(help="auto, bf16 or fp32.")] = None,
    seed: Annotated[int, typer.Option(help="Decides weights, order and augmentation.", min=0)] = 0,
    device: Device = "auto",
) -> None:
    """Train the network on a folder of shards, show a table, and name its pictures.

    Stopped at any time and called again, it goes on where it was. The epoch and the voting rounds are chosen on the
    validation split; the test split is looked at once, at the end.

    Example: meshshard train minicoseg --epochs 30
    """
    folder = locate(data)
    from meshshard import open_dataset
    from meshshard.files import lock_folder
    from meshshard_train.device import choose_device
    from meshshard_train.loop import train as run_training
    from meshshard_train.results import write_results

    dataset = open_dataset(folder)
    if dataset.task == "correspondence":
        raise UsageError(
            f"{folder} is for correspondence, which is not trained here; read its shards with open_dataset"
        )
    if dataset.task not in TASKS:
        raise UsageError(f"{folder} has no labels, and training needs them; see docs/datasets.md")
    if recipe not in RECIPES:
        raise UsageError(f"no training recipe is called {recipe!r}; there are {', '.join(RECIPES)}")
    chosen: dict[str, Any] = {
        "epochs": epochs,
        "learning_rate": learning_rate,
        "features": tuple(features.split(",")) if features else None,
        "scaling": scaling,
        "rotation_axes": "" if rotation_axes == "none" else rotation_axes,
        "batch_vertices": batch_vertices,
        "precision": precision,
    }
    config = RECIPES[recipe](dataset.task, seed=seed, **{k: v for k, v in chosen.items() if v is not None})
    place = run or RUNS / dataset.name
    where = choose_device(device)
    try:
        with lock_folder(place), _progress(config.epochs, len(dataset.splits.get("train", ()))) as tell:
            history = run_training(dataset, config, place, where, tell)
            results, pictures = write_results(dataset, place, history, where)
    except KeyboardInterrupt:
        raise UsageError("stopped; the same command goes on after the last whole epoch") from None
    _print_results(results)
    for path in (*pictures, place / "results.json"):
        typer.echo(str(path))


def evaluate(
    run: Run,
    split: Annotated[str, typer.Option(help="Split to evaluate.")] = "test",
    data: Annotated[str | None, typer.Option(help="Another data set (default: the one trained on).")] = None,
    device: Device = "auto",
    as_json: AsJson = False,
) -> None:
    """Accuracy and IoU of a trained network on a split, raw and voted (rounds as chosen on validation).

    Example: meshshard evaluate runs/minicoseg --split test --json
    """
    from meshshard import open_dataset
    from meshshard_train import checkpoint
    from meshshard_train.data import check_task
    from meshshard_train.device import choose_device
    from meshshard_train.evaluate import evaluate as run_evaluation
    from meshshard_train.loop import BEST
    from meshshard_train.results import chosen_rounds

    best = checkpoint.load(run / BEST)
    dataset = open_dataset(locate(data or best.state["folder"]))
    check_task(dataset, best.config)
    if clashes := best.clashes(dataset) if data else best.other_data(dataset):
        raise UsageError(f"{run} was trained on other data than {dataset.folder} holds: " + "; ".join(clashes))
    where = choose_device(device)
    network = best.network().to(where)
    rounds = chosen_rounds(run)
    found = run_evaluation(network, dataset, dataset.splits.get(split, ()), best.config, where, (rounds,))
    results = {
        "dataset": dataset.name,
        "task": best.config.task,
        "epoch": best.state["epoch"],
        "voting_rounds": rounds,
        "splits_sha256": dataset.index.splits_sha256,
        "class_iou": dict(zip(dataset.classes, found.raw.class_iou(), strict=True)),
        "rows": {split: found.row(rounds)},
    }
    if as_json:
        typer.echo(to_json(results))
    else:
        _print_results(results)


def predict(
    run: Run,
    mesh: Annotated[list[Path], typer.Argument(help="Mesh files, or folders of them.")],
    out: Annotated[Path, typer.Option(help="Folder for the results.")] = Path("predictions"),
    device: Device = "auto",
) -> None:
    """Label meshes that were never in a data set: raw files in; coloured PLY, PNG and a label file each out.

    Features are computed with the recipe stored in the checkpoint. Exit status 1 when a mesh was refused.

    Example: meshshard predict runs/minicoseg chair.obj --out labelled
    """
    from meshshard import open_dataset
    from meshshard_train import checkpoint
    from meshshard_train.device import choose_device
    from meshshard_train.loop import BEST
    from meshshard_train.prediction_files import write_predictions

    best = checkpoint.load(run / BEST)
    where = choose_device(device)
    for path in mesh:
        if not path.exists():
            raise UsageError(f"{path}: no such mesh file or folder")
    names = [path.stem for path in mesh]
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise UsageError(f"two meshes called {twice[0]} would write the same files; give them different --out")
    refused = False
    for path in mesh:
        with tempfile.TemporaryDirectory() as scratch:
            recipe = Path(scratch) / "recipe.json"
            recipe.write_text(best.recipe.to_json())
            # The halves meet in files: the mesh becomes a shard, made by the program that makes all shards.
            command = [sys.executable, "-m", "meshshard", "features", str(path.resolve()), "--no-labels"]
            command += ["--recipe", str(recipe), "--out", scratch, "--jobs", "1" if path.is_file() else "-1"]
            done = subprocess.run(command, stdout=subprocess.PIPE, check=False)
            if done.returncode > 1:
                raise typer.Exit(done.returncode)  # it has said why
            dataset = open_dataset(scratch)
            for line in write_predictions(best, dataset, out, where):
                typer.echo(line)
            for entry in (*dataset.index.refused, *dataset.index.failed):
                refused = True
                typer.echo(f"refused  {entry.message}", err=True)
    raise typer.Exit(1 if refused else 0)


def _print_results(results: dict[str, Any]) -> None:
    from meshshard_train.results import table_rows

    head, *rows = table_rows(results)
    table = Table(
        *head, title=f"{results['dataset']}, epoch {results['epoch']}, % ({results['voting_rounds']} rounds)"
    )
    for row in rows:
        table.add_row(*row)
    Console().print(table)


@contextmanager
def _progress(epochs: int, meshes: int) -> Iterator["Callable[[Progress], None]"]:
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

        def tell(progress: "Progress") -> None:
            nonlocal validation
            if progress.metrics:
                validation = f", validation {100 * progress.metrics['val_accuracy']:.1f} %"
            done = progress.epoch * meshes + progress.meshes
            what = f"epoch {progress.epoch + 1}/{epochs}, loss {progress.loss:.3f}, rate {progress.learning_rate:.1e}"
            bar.update(task, completed=done, description=what + validation)

        yield tell


def _print_epoch(progress: "Progress") -> None:
    if progress.metrics:
        row = progress.metrics
        typer.echo(
            f"epoch {row['epoch']}  loss {row['loss']:.4f}  rate {row['learning_rate']:.2e}  "
            f"val accuracy {100 * row['val_accuracy']:.2f} %  {row['seconds']:.1f} s",
            err=True,
        )
