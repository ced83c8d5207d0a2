"""What is measured on the processor: training beside the published loop, voting, waiting for data, starting."""

import itertools
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Generator, Sequence
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import scipy.sparse as sp
import torch

from meshshard import Dataset
from meshshard_train.bench.peer import ACCUMULATED, Peer, vote_around_vertices
from meshshard_train.bench.shapes import CLASSES, sample, write_obj
from meshshard_train.checkpoint import network_for
from meshshard_train.compiling import compiled
from meshshard_train.config import TrainConfig
from meshshard_train.data import steps_of
from meshshard_train.loading import Loading, Meshes
from meshshard_train.loop import _step
from meshshard_train.recipes import paper
from meshshard_train.state import State, started
from meshshard_train.team import Team
from meshshard_train.voting import neighbours, vote

K = TypeVar("K")

PACKED = (2, 3, 5, 10)
"""Meshes a step: fewer than the peer accumulates, as many, as recipe paper packs, and more. Each divides the meshes
of an epoch."""
LOADINGS = {
    "kept": Loading(),
    "streamed in the same process": Loading(keep_gib=0.0),
    "streamed by 2 workers": Loading(keep_gib=0.0, workers=2),
}
VOTES = 20
CPU = torch.device("cpu")


def interleaved(rounds: int, calls: dict[K, Callable[[], Any]]) -> dict[K, dict[str, float]]:
    """Seconds of each call: `median` and `least` elapsed, `cpu` the median of what all threads compute. They take
    turns, after one that does not count."""
    spent: dict[K, list[tuple[float, float]]] = {name: [] for name in calls}
    for number in range(rounds + 1):
        for name, call in calls.items():
            start, computing = time.perf_counter(), time.process_time()
            call()
            if number:
                spent[name].append((time.perf_counter() - start, time.process_time() - computing))
    figures = {}
    for name, times in spent.items():
        elapsed, computed = zip(*times, strict=True)
        figures[name] = {
            "median": statistics.median(elapsed),
            "least": min(elapsed),
            "cpu": statistics.median(computed),
        }
    return figures


def our_training(
    dataset: Dataset, config: TrainConfig, loading: Loading, device: torch.device, compiling: bool = False
) -> Generator[float, None, None]:
    """Training without an end: a step at a time, seconds waited for its batch."""
    torch.manual_seed(config.seed)
    numbers = dataset.splits["train"]
    meshes = Meshes(dataset, config, device, loading)
    state = our_state(dataset, config, device)
    if compiling:
        state.forward = compiled(state.network, config, device)
    for _ in meshes.batches([[number] for number in numbers], None):  # what is kept is prepared
        pass
    for epoch in itertools.count():
        plan = steps_of(numbers, dataset.vertex_counts, config, epoch)
        batches = meshes.batches(plan, epoch)
        for members in plan:
            start = time.perf_counter()
            batch = next(batches)
            waited = time.perf_counter() - start
            _step(state, batch, members, meshes, config.learning_rate, Team())
            yield waited


def our_state(dataset: Dataset, config: TrainConfig, device: torch.device) -> State:
    """A network to train, as the loop makes it."""
    network = network_for(config, len(dataset.recipe.times), len(dataset.classes)).to(device)
    network.train()
    return started(network, config)


def packing(dataset: Dataset, meshes: int) -> TrainConfig:
    """Recipe paper, with so many meshes a step."""
    return paper("segmentation", batch_vertices=meshes * dataset.vertex_counts[0])


def training(
    dataset: Dataset, folder: Path, rounds: int, packed: Sequence[int] = PACKED, compiling: bool = False
) -> list[dict[str, Any]]:
    """Milliseconds a mesh of our training by meshes a step, the last also `compiling`; of the peer with its rereading
    and voting and without."""
    runs = {("ours", count): our_training(dataset, packing(dataset, count), Loading(), CPU) for count in packed}
    if compiling:
        config = packing(dataset, packed[-1])
        runs["ours, compiled", packed[-1]] = our_training(dataset, config, Loading(), CPU, compiling)
    peer = Peer([dataset[number] for number in dataset.splits["train"]], folder)
    calls: dict[tuple[str, int], Callable[[], Any]] = {way: partial(next, run) for way, run in runs.items()}
    calls["peer", ACCUMULATED] = partial(peer.train, voting=True)
    calls["peer without voting", ACCUMULATED] = partial(peer.train, voting=False)
    spent = interleaved(rounds, calls)
    ms = {way: {name: 1e3 * seconds / way[1] for name, seconds in times.items()} for way, times in spent.items()}
    voting, plain = ms["peer", ACCUMULATED], ms["peer without voting", ACCUMULATED]
    return [
        {
            "way": way,
            "meshes": count,
            "ms": times["median"],
            "least_ms": times["least"],
            "cpu_ms": times["cpu"],
            "ratio": voting["median"] / times["median"],
            "ratio_without_voting": plain["median"] / times["median"],
            "cpu_ratio": voting["cpu"] / times["cpu"],
        }
        for (way, count), times in ms.items()
    ]


def voting(folder: Path, rounds: int) -> dict[str, float]:
    """Milliseconds of 20 rounds on a mesh of 1500 faces, neighbours found each time (ours) and before (found); of
    3 rounds as published."""
    mesh = sample(0)
    path = write_obj(folder, mesh)
    noise = np.random.default_rng(0)
    assert mesh.face_labels is not None
    labels = mesh.face_labels.astype(np.int64)
    wrong = noise.random(len(labels)) < 0.2
    labels[wrong] = noise.integers(len(CLASSES), size=int(wrong.sum()))

    def published() -> None:
        voted = labels
        for _ in range(3):
            voted = vote_around_vertices(path, voted)

    def found() -> sp.csr_array:
        return neighbours(mesh.faces, len(mesh.vertices), "segmentation")

    near = found()
    calls = {"ours_ms": lambda: vote(labels, found(), VOTES), "found_ms": lambda: vote(labels, near, VOTES)}
    spent = interleaved(rounds, {**calls, "peer_ms": published})
    return {name: 1e3 * times["median"] for name, times in spent.items()}


def waiting(dataset: Dataset, steps: int) -> dict[str, float]:
    """Way of loading -> share of a training step that is spent waiting for its batch, at the recipe's default."""
    shares = {}
    for name, loading in LOADINGS.items():
        run = our_training(dataset, paper("segmentation"), loading, CPU)
        next(run)
        start = time.perf_counter()
        waited = sum(itertools.islice(run, steps))
        shares[name] = waited / (time.perf_counter() - start)
        run.close()
    return shares


def starting(rounds: int) -> dict[str, float]:
    """Elapsed seconds from the call to the end, of programs that do not compute."""
    programs = {
        "python alone": ["-c", ""],
        "import meshshard_train": ["-c", "import meshshard_train"],
        "meshshard train --help": ["-m", "meshshard", "train", "--help"],
    }
    calls: dict[str, Callable[[], Any]] = {
        name: partial(subprocess.run, [sys.executable, *words], check=True, capture_output=True)
        for name, words in programs.items()
    }
    return {name: times["median"] for name, times in interleaved(rounds, calls).items()}
