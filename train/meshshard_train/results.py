"""What a finished run leaves for people: results.json, results.md, the model card and pictures."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import torch

from meshshard import Dataset, UsageError
from meshshard.files import publish, sha256_of_file
from meshshard.plain import to_json
from meshshard_train import checkpoint
from meshshard_train.card import hardware, write_card
from meshshard_train.checkpoint import Checkpoint
from meshshard_train.config import VOTED, TrainConfig
from meshshard_train.evaluate import VOTING_ROUNDS, Evaluation, evaluate
from meshshard_train.facts import facts_of, of_history
from meshshard_train.loading import Loading, Meshes
from meshshard_train.matching_results import write_matching_results
from meshshard_train.members import classes_without, training_numbers
from meshshard_train.metrics import Confusion
from meshshard_train.model import TaskDrivenNet
from meshshard_train.pictures import Tile, confusions, curves, gallery
from meshshard_train.predict import predictions
from meshshard_train.state import BEST
from meshshard_train.tables import about, markdown
from meshshard_train.tasks import LABELS, labels_of, of_corners

RESULTS = "results.json"


def write_results(
    dataset: Dataset, run: Path, history: Sequence[dict[str, Any]], device: torch.device, loading: Loading = Loading()
) -> tuple[dict[str, Any], list[Path]]:
    """Evaluate the best epoch on validation, then once on test; write the tables and the pictures, and name them.

    Epoch and voting rounds are chosen as the configuration's `protocol` says; a split that was trained on, or is not
    there, has no row.
    """
    best = checkpoint.load(run / BEST)
    if best.config.task == "correspondence":
        return write_matching_results(best, dataset, run, history, device, loading)
    network = best.network().to(device)
    meshes, rounds, found = Meshes(dataset, best.config, device, loading), best.config.voting_rounds, {}
    if best.config.selection == "validation":
        found["val"] = evaluate(network, meshes, dataset.splits["val"], VOTING_ROUNDS if rounds < 0 else [rounds])
        rounds = found["val"].best_rounds()
    rounds = max(rounds, 0)
    if dataset.splits.get("test"):
        found["test"] = evaluate(network, meshes, dataset.splits["test"], [rounds])
    results = results_of(best, dataset, found, rounds) | {
        **of_history(history),
        "classes_not_trained": classes_without(dataset, training_numbers(dataset, best.config), best.config.task),
        "checkpoint_sha256": sha256_of_file(run / BEST),
        "finished_on": hardware(device),
    }
    publish(run / RESULTS, to_json(results).encode() + b"\n")
    publish(run / "results.md", markdown(results).encode())
    write_card(run, best, dataset, results, device)
    return results, _draw(results, network, meshes, run, history)


def results_of(
    best: Checkpoint, dataset: Dataset, found: Mapping[str, Evaluation], rounds: int, *, rounds_set: bool = False
) -> dict[str, Any]:
    """The figures of some splits, and all that they depend on. `rounds_set`: the rounds of voting are not the run's
    own."""
    how = replace(best.config, voting_rounds=rounds) if rounds_set else best.config
    return facts_of(best, dataset, list(found)) | {
        "protocol": how.protocol,
        "voting_rounds": rounds,
        "rounds_set": rounds_set,
        "classes": list(dataset.classes),
        "rows": {split: evaluation.row(rounds) for split, evaluation in found.items()},
        "per_class": {
            split: {kind: _per_class(confusion, dataset.classes) for kind, confusion in each.kinds(rounds).items()}
            for split, each in found.items()
        },
        "confusion": {
            split: {kind: confusion.counts.astype(int).tolist() for kind, confusion in each.kinds(rounds).items()}
            for split, each in found.items()
        },
    }


def rounds_of(run: Path, config: TrainConfig) -> int:
    """Rounds of voting of a finished run: as configured, or as its validation split chose them; 0 without voting.
    UsageError: they are not known, because the run is not finished, or results.json is of another checkpoint."""
    if config.voting_rounds >= 0 or config.task not in VOTED:
        return max(config.voting_rounds, 0)
    if not is_finished(run):
        raise UsageError(f"{run} is not finished: {RESULTS} is not of its {BEST}; go on with meshshard train")
    rounds = json.loads((run / RESULTS).read_bytes())["voting_rounds"]
    if type(rounds) is not int or rounds < 0:
        raise UsageError(f"{run / RESULTS}: voting_rounds is 0 or more, not {rounds!r}; go on with meshshard train")
    return rounds


def is_finished(run: Path) -> bool:
    """Whether results.json is of the run's best checkpoint. UsageError: it is there and is no such table."""
    try:
        found = json.loads((run / RESULTS).read_bytes())
        return bool(found["checkpoint_sha256"] == sha256_of_file(run / BEST))
    except FileNotFoundError:
        return False
    except (OSError, ValueError, KeyError, TypeError, RecursionError) as error:
        raise UsageError(f"{run / RESULTS} cannot be read ({error!r}): go on with meshshard train") from error


def _per_class(confusion: Confusion, classes: Sequence[str]) -> dict[str, dict[str, float]]:
    figures = confusion.of_classes()
    return {name: {figure: figures[figure][k] for figure in figures} for k, name in enumerate(classes)}


def _draw(
    results: dict[str, Any], network: TaskDrivenNet, meshes: Meshes, run: Path, history: Sequence[dict[str, Any]]
) -> list[Path]:
    """Curves; of each split the confusion matrices, and some meshes where their parts are labelled."""
    pictures = [run / "curves.png"]
    curves(pictures[0], history, title=about(results).replace("; ", "\n"))
    for split, matrices in results["confusion"].items():
        pictures.append(run / f"confusion-{split}.png")
        title = f"{results['dataset']}, {split}\n{results['protocol']}"
        counts = {kind: np.array(matrix) for kind, matrix in matrices.items()}
        confusions(pictures[-1], counts, results["classes"], title=title)
        if results["task"] in LABELS:
            pictures.append(run / f"{split}.png")
            _draw_split(network, meshes, split, pictures[-1])
    return pictures


def _draw_split(network: TaskDrivenNet, meshes: Meshes, split: str, path: Path) -> None:
    """Labels above, predictions below, of up to six meshes spread over the split."""
    dataset = meshes.dataset
    numbers = dataset.splits[split]
    shown = numbers[:: -(-len(numbers) // 6)]
    tiles: list[list[Tile]] = [[], []]
    for number, labels, _ in predictions(network, meshes, shown):
        sample = dataset[number]
        truth = labels_of(sample, meshes.config.task)
        right = (labels == truth)[truth >= 0]
        said = f"predicted, {100 * right.mean():.1f} % right" if len(right) else "predicted"
        name = sample.id.split("/")[-1]
        for row, values, title in (
            (0, truth, name[:24]),
            (1, labels, said),
        ):
            drawn = of_corners(values, sample, meshes.config.task)
            tiles[row].append(Tile(title=title, vertices=sample.vertices, faces=sample.faces, labels=drawn))
    title = f"{dataset.name}, {split}: labels above, predictions (raw) below\n{meshes.config.protocol}"
    colours = dataset.index.colours
    gallery(path, [*tiles[0], *tiles[1]], dataset.classes, columns=len(shown), title=title, colours=colours)
