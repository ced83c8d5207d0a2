"""meshshard evaluate: the figures of a run on a split."""

from typing import Annotated

import typer

from meshshard.commands import AsJson, locate
from meshshard.errors import UsageError
from meshshard.plain import to_json
from meshshard.remote import to_path
from meshshard_train.commands.shared import Device, Run, print_results, wait_quietly


def evaluate(
    run: Run,
    split: Annotated[str, typer.Option(help="Split to evaluate.")] = "test",
    data: Annotated[str | None, typer.Option(help="Another data set (default: the one trained on).")] = None,
    rounds: Annotated[int | None, typer.Option(help="Rounds of voting (default: the run's).", min=0)] = None,
    device: Device = "auto",
    as_json: AsJson = False,
) -> None:
    """All figures of a run's best epoch on a split, raw and voted, and those of each class.

    Example: meshshard evaluate runs/minicoseg --split test --json
    """
    wait_quietly()
    from meshshard import open_dataset
    from meshshard_train import checkpoint
    from meshshard_train.config import VOTED
    from meshshard_train.device import choose_device
    from meshshard_train.evaluate import evaluate as run_evaluation
    from meshshard_train.loading import Loading, Meshes
    from meshshard_train.matching_results import matching_results
    from meshshard_train.results import is_finished, results_of, rounds_of
    from meshshard_train.state import BEST
    from meshshard_train.tasks import check_task

    if run.is_file():
        raise UsageError(f"{run} is a file: name the folder of its run, as meshshard evaluate {run.parent}")
    best = checkpoint.load(run / BEST)
    trained_on = best.state["folder"]
    if data is None and not to_path(trained_on).exists():
        raise UsageError(f"{run} was trained on {trained_on}, which is not there: name its shards with --data FOLDER")
    dataset = open_dataset(locate(data or trained_on))
    check_task(dataset, best.config)
    if clashes := best.clashes(dataset) if data else best.other_data(dataset):
        raise UsageError(
            f"{run} was trained on other data than {dataset.folder} holds: {'; '.join(clashes)}. Features may be "
            "anywhere: --data FOLDER; a data set of the same classes and recipe is evaluated with --data too"
        )
    if rounds is not None and best.config.task not in VOTED:
        raise UsageError(f"--rounds is for {' and '.join(VOTED)}, and {run} is a run for {best.config.task}")
    if not (numbers := dataset.splits.get(split, ())):
        others = ", ".join(f"--split {name}" for name, members in dataset.splits.items() if name and members)
        raise UsageError(f"{dataset.folder} has no meshes in the split {split!r}; there are: {others or 'no splits'}")
    where = choose_device(device)
    if best.config.task == "correspondence":
        errors = matching_results(best, dataset, [split], where)
        typer.echo(to_json(errors)) if as_json else print_results(errors)
        return
    chosen = rounds_of(run, best.config) if rounds is None else rounds
    network, meshes = best.network().to(where), Meshes(dataset, best.config, where, Loading())
    found = {split: run_evaluation(network, meshes, numbers, [chosen])}
    results = results_of(best, dataset, found, chosen, rounds_set=rounds is not None) | {"finished": is_finished(run)}
    if as_json:
        typer.echo(to_json(results))
    else:
        print_results(results)
