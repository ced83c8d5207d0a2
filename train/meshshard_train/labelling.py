"""Meshes labelled by a trained network: it runs here, and what it says is written by processes beside it."""

import os
from collections import deque
from collections.abc import Iterable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import torch

from meshshard import Dataset, UsageError
from meshshard_train.checkpoint import Checkpoint
from meshshard_train.config import VOTED
from meshshard_train.loading import Loading, Meshes
from meshshard_train.predict import predictions
from meshshard_train.prediction_files import Outputs, write_mesh
from meshshard_train.results import is_finished, rounds_of
from meshshard_train.state import BEST
from meshshard_train.voting import elected

MESHES_A_PROCESS = 8
"""It takes longer to start one than to draw fewer; what is not drawn is written in no time."""

Call = tuple[Any, ...]
"""What `write_mesh` takes."""


def known_rounds(best: Checkpoint, run: Path) -> int | None:
    """Rounds of voting that a run was told to take, or chose on validation, which stands in its folder; 0 where whole
    meshes are classified; None where nothing is known of them."""
    config = best.config
    file, folder = (run, run.parent) if run.is_file() else (run / BEST, run)
    told = config.voting_rounds >= 0 or config.task not in VOTED or (file.name == BEST and is_finished(folder))
    return rounds_of(folder, config) if told else None


def outputs_of(best: Checkpoint, rounds: int, *, pictures: bool) -> Outputs:
    """What the network's outputs mean, after some rounds of voting. UsageError: they are no classes, or classes of
    whole meshes, which have no neighbours to vote with."""
    task = best.config.task
    if task == "correspondence":
        raise UsageError("the network gives coordinates for correspondence, no classes; see: meshshard evaluate")
    if task == "classification" and rounds:
        raise UsageError(f"--vote {rounds}: neighbouring faces or vertices vote, and the network classifies meshes")
    return Outputs(
        task=task,
        classes=best.classes,
        colours=tuple(best.state["colours"]),
        recipe=best.recipe,
        rounds=rounds,
        pictures=pictures,
    )


def label_meshes(
    best: Checkpoint,
    outputs: Outputs,
    dataset: Dataset,
    places: dict[str, tuple[Path, Path]],
    device: torch.device,
    jobs: int = 1,
) -> Iterator[dict[str, Any]]:
    """Label every sample of a data set and write its files; yields what `write_mesh` returns, in order.

    `places`: `source` of a sample -> its mesh file, and where results go. `jobs`: processes that write, -1 for one a
    core. UsageError: features of another recipe or algorithm than those learned from.
    """
    made, learned = dataset.index.algorithm_version, best.state["algorithm_version"]
    if dataset.recipe != best.recipe or made != learned:
        raise UsageError(
            f"features by {dataset.recipe.to_json()}, algorithm {made}; the network learned {best.recipe.to_json()}, "
            f"algorithm {learned}: train anew, or install the meshshard it was trained with"
        )
    calls = _calls(best, outputs, dataset, places, device)
    most = jobs if jobs > 0 else os.cpu_count() or 1
    return _written(calls, min(most, len(dataset) // MESHES_A_PROCESS) if outputs.pictures else 1)


def _calls(
    best: Checkpoint, outputs: Outputs, dataset: Dataset, places: dict[str, tuple[Path, Path]], device: torch.device
) -> Iterator[Call]:
    network, meshes = best.network().to(device), Meshes(dataset, best.config, device, Loading(keep_gib=0.0))
    for number, labels, probabilities in predictions(network, meshes, range(len(dataset))):
        sample = dataset[number]
        if outputs.rounds:
            (labels,) = elected(labels, probabilities, sample, best.config, [outputs.rounds])
        if outputs.task == "vertex_segmentation":
            labels = np.where(sample.used_vertices, labels, -1)
        yield outputs, sample, labels, probabilities, *places[sample.source]


def _written(calls: Iterable[Call], processes: int) -> Iterator[dict[str, Any]]:
    """Results of `write_mesh` in order; few calls wait at a time."""
    if processes < 2:
        yield from (write_mesh(*call) for call in calls)
        return
    try:
        with ProcessPoolExecutor(processes, get_context("spawn")) as pool:
            waiting: deque[Future[dict[str, Any]]] = deque()
            for call in calls:
                waiting.append(pool.submit(write_mesh, *call))
                if len(waiting) > 4 * processes:
                    yield waiting.popleft().result()
            while waiting:
                yield waiting.popleft().result()
    except BrokenProcessPool as error:
        raise UsageError(
            "a process that draws was killed, for want of memory perhaps: try --jobs 1, or --no-pictures"
        ) from error
