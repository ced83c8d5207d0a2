"""A run's opinion on meshes, for `meshshard view`."""

from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float, Int

from meshshard import Dataset, UsageError
from meshshard.view.opinion import Judge, Opinion
from meshshard_train.checkpoint import Checkpoint
from meshshard_train.loading import Loading, Meshes
from meshshard_train.predict import predictions
from meshshard_train.tasks import labels_of

ELEMENTS = {"segmentation": "faces", "vertex_segmentation": "vertices", "classification": "mesh"}
SCORES = {"segmentation": "accuracy", "vertex_segmentation": "accuracy", "classification": "probability of its class"}


def judge_of(best: Checkpoint, run: Path, dataset: Dataset, device: torch.device) -> Judge:
    """What a network says after its run's rounds of voting, none where they are not known. A score is the share of
    labelled faces or vertices that it gets right; of a class of the whole mesh, how probable it finds that.

    UsageError: the network gives no classes, or others than the data set has, or takes other features.
    """
    task = best.config.task
    if task not in ELEMENTS:
        raise UsageError(f"{run} is a run for {task}: it gives no classes to look at; see: meshshard evaluate {run}")
    if dataset.classes and (clashes := best.clashes(dataset)):
        raise UsageError(f"{run} cannot be used on {dataset.folder}: {'; '.join(clashes)}")
    network = best.network().to(device)

    @cache
    def rounds() -> int:
        from meshshard_train.labelling import known_rounds  # slow to import: not before the page is there

        return known_rounds(best, run) or 0

    def opinions(numbers: Sequence[int]) -> Iterator[Opinion]:
        from meshshard_train.voting import elected  # as slow

        # batches of its own: opinions on one mesh are asked for while those on all are under way
        meshes = Meshes(dataset, best.config, device, Loading(keep_gib=0.0))
        for number, labels, probabilities in predictions(network, meshes, numbers):
            sample = dataset[number]
            truth = labels_of(sample, task)
            if rounds():
                (labels,) = elected(labels, probabilities, sample, best.config, [rounds()])
            if task == "vertex_segmentation":
                labels = np.where(sample.used_vertices, labels, -1)
            yield Opinion(labels, _score(truth, labels, probabilities, task))

    return Judge(
        name=run.resolve().name,
        classes=best.classes,
        colours=tuple(best.state["colours"]),
        element=ELEMENTS[task],
        score=SCORES[task],
        opinions=opinions,
    )


def _score(
    truth: Int[np.ndarray, " n"], labels: Int[np.ndarray, " n"], probabilities: Float[np.ndarray, "n K"], task: str
) -> float:
    known = truth >= 0
    if not known.any():
        return float("nan")
    if task == "classification":
        return float(probabilities[0, truth[0]])
    return float((labels == truth)[known].mean())
