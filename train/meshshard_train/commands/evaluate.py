"""meshshard evaluate: the figures of a finished run on a split."""

from typing import Annotated

import typer

from meshshard.commands import AsJson, locate
from meshshard.errors import UsageError
from meshshard.plain import to_json
from meshshard_train.commands.shared import Device, Run, print_results, wait_quietly


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
    wait_quietly()
    from meshshard import open_dataset
    from meshshard_train import checkpoint
    from meshshard_train.device import choose_device
    from meshshard_train.evaluate import evaluate as run_evaluation
    from meshshard_train.loading import Loading, Meshes
    from meshshard_train.results import chosen_rounds
    from meshshard_train.state import BEST
    from meshshard_train.tasks import check_task

    best = checkpoint.load(run / BEST)
    dataset = open_dataset(locate(data or best.state["folder"]))
    check_task(dataset, best.config)
    if clashes := best.clashes(dataset) if data else best.other_data(dataset):
        raise UsageError(f"{run} was trained on other data than {dataset.folder} holds: " + "; ".join(clashes))
    where = choose_device(device)
    network, meshes = best.network().to(where), Meshes(dataset, best.config, where, Loading())
    rounds = chosen_rounds(run)
    found = run_evaluation(network, meshes, dataset.splits.get(split, ()), [rounds])
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
        print_results(results)
