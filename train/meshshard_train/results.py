"""What a finished run leaves for people: results.json, results.md, the model card and pictures."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import torch

from meshshard import Dataset, UsageError
from meshshard.files import publish
from meshshard.plain import to_json
from meshshard_train import checkpoint
from meshshard_train.card import write_card
from meshshard_train.evaluate import VOTING_ROUNDS, evaluate
from meshshard_train.loading import Loading, Meshes
from meshshard_train.model import TaskDrivenNet
from meshshard_train.pictures import Tile, curves, gallery
from meshshard_train.predict import predictions
from meshshard_train.state import BEST

RESULTS = "results.json"
FIGURES = ("accuracy", "area_accuracy", "mean_iou")


def write_results(
    dataset: Dataset, run: Path, history: Sequence[dict[str, Any]], device: torch.device, loading: Loading = Loading()
) -> tuple[dict[str, Any], list[Path]]:
    """Evaluate the best epoch on validation, then once on test; write the table and the pictures, and name them.

    Epoch and voting rounds are chosen as the configuration's `protocol` says; a split that was trained on, or is not
    there, has no row.
    """
    best = checkpoint.load(run / BEST)
    network = best.network().to(device)
    meshes, rounds, rows = Meshes(dataset, best.config, device, loading), best.config.voting_rounds, {}
    if best.config.selection == "validation":
        on_val = evaluate(network, meshes, dataset.splits["val"], VOTING_ROUNDS if rounds < 0 else [rounds])
        rounds = on_val.best_rounds()
        rows["val"] = on_val.row(rounds)
    if dataset.splits.get("test"):
        rows["test"] = evaluate(network, meshes, dataset.splits["test"], [rounds]).row(rounds)
    results = {
        "dataset": dataset.name,
        "task": best.config.task,
        "recipe": best.config.recipe,
        "feature_recipe": best.recipe.name,
        "protocol": best.config.protocol,
        "epoch": best.state["epoch"],
        "epochs": len(history),
        "voting_rounds": rounds,
        "seed": best.config.seed,
        "splits_sha256": best.splits_sha256,
        "seconds": round(sum(row["seconds"] for row in history), 1),
        "rows": rows,
    }
    publish(run / RESULTS, to_json(results).encode() + b"\n")
    publish(run / "results.md", _markdown(results).encode())
    write_card(run, best, dataset, results, device)
    pictures = [run / "curves.png"]
    curves(pictures[0], history, title=f"{dataset.name}, recipe {best.config.recipe}")
    if best.config.task == "segmentation":
        for split in rows:
            pictures.append(run / f"{split}.png")
            _draw_split(network, meshes, split, pictures[-1])
    return results, pictures


def chosen_rounds(run: Path) -> int:
    """Rounds of voting that a finished run chose on its validation split."""
    try:
        return int(json.loads((run / RESULTS).read_bytes())["voting_rounds"])
    except FileNotFoundError:
        raise UsageError(f"{run} is not finished: there is no {RESULTS}; go on with meshshard train") from None
    except (OSError, ValueError, KeyError) as error:
        raise UsageError(f"{run / RESULTS} cannot be read ({error}): write it again with meshshard train") from error


def table_rows(results: dict[str, Any]) -> list[list[str]]:
    """Head and rows of the results table, in per cent."""
    voted = [f"voted_{name}" for name in FIGURES] if results["task"] == "segmentation" else []
    names = [*FIGURES, *voted] if voted else ["accuracy"]
    head = ["split", *(name.replace("_", " ") for name in names)]
    return [head, *([split, *(f"{100 * row[name]:.2f}" for name in names)] for split, row in results["rows"].items())]


def _markdown(results: dict[str, Any]) -> str:
    head, *rows = table_rows(results)
    lines = [head, ["---"] * len(head), *rows]
    about = (
        f"{results['dataset']}, recipe {results['recipe']}, seed {results['seed']}: epoch {results['epoch']} of "
        f"{results['epochs']}, {results['voting_rounds']} rounds of voting; {results['protocol']}. Per cent."
    )
    return about + "\n\n" + "".join(f"| {' | '.join(line)} |\n" for line in lines)


def _draw_split(network: TaskDrivenNet, meshes: Meshes, split: str, path: Path) -> None:
    """Labels above, predictions below, of up to six meshes spread over the split."""
    dataset = meshes.dataset
    numbers = dataset.splits[split]
    shown = numbers[:: -(-len(numbers) // 6)]
    tiles: list[list[Tile]] = [[], []]
    for number, labels, _ in predictions(network, meshes, shown):
        sample = dataset[number]
        assert sample.face_labels is not None
        right = (labels == sample.face_labels)[sample.face_labels >= 0].mean()
        name = sample.id.split("/")[-1]
        for row, values, title in (
            (0, sample.face_labels, name[:24]),
            (1, labels, f"predicted, {100 * right:.1f} % right"),
        ):
            tiles[row].append(Tile(title=title, vertices=sample.vertices, faces=sample.faces, labels=values))
    title = f"{dataset.name}, {split}: labels above, predictions (raw) below"
    colours = dataset.index.colours
    gallery(path, [*tiles[0], *tiles[1]], dataset.classes, columns=len(shown), title=title, colours=colours)
