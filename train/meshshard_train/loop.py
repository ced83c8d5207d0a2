"""Training, read top to bottom. One run is one folder; started again, it goes on where it stopped, to the bit."""

import copy
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import chain, groupby
from operator import itemgetter
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from meshshard import Dataset, UsageError
from meshshard_train import checkpoint
from meshshard_train.compiling import compiled
from meshshard_train.config import VOTED, TrainConfig
from meshshard_train.data import Batch, steps_of
from meshshard_train.device import autocast, uses_bfloat16
from meshshard_train.evaluate import evaluate
from meshshard_train.loading import Loading, Meshes, Timed
from meshshard_train.loss import logits_of, mesh_losses
from meshshard_train.matching import evaluate_matching
from meshshard_train.members import JUDGES, judging_numbers, keys_of, training_numbers
from meshshard_train.schedule import is_over, learning_rate
from meshshard_train.state import LAST, State, publish_config, publish_epoch, resume, save, started
from meshshard_train.tasks import check_task
from meshshard_train.team import Team

SAVE_SECONDS = 300.0
"""Between two checkpoints within an epoch."""


@dataclass(frozen=True, kw_only=True)
class Progress:
    """Where training is. `epoch`: the one at work; `meshes`: how many of it are done; `loss`: their mean, or
    of the epoch before, or NaN; `history`: the rows of all whole epochs, which are in metrics.jsonl by then."""

    epoch: int
    meshes: int
    loss: float
    learning_rate: float
    history: Sequence[dict[str, Any]]


def train(
    dataset: Dataset,
    config: TrainConfig,
    run: Path,
    device: torch.device,
    report: Callable[[Progress], None] = lambda progress: None,  # noqa: ARG005
    loading: Loading = Loading(),
    team: Team = Team(),
    compiling: bool = False,
) -> list[dict[str, Any]]:
    """Train to the configuration's last epoch and return the history, one row an epoch.

    `report` is told at the start, after each step and after each epoch.
    `run` gets last.safetensors (all of the state, after every epoch and every five minutes), best.safetensors (the
    epoch with the highest score, the last of equals) and metrics.jsonl; the checkpoints before them stay as
    previous-*. A run that is there goes on from its last checkpoint. UsageError when it was started with another
    configuration, data or classes, when a loss or its gradient is not finite, or the disk is full.
    """
    check_task(dataset, config)
    team.check(config)
    numbers, judges = training_numbers(dataset, config), judging_numbers(dataset, config)
    meshes = Meshes(dataset, config, device, loading)
    torch.manual_seed(config.seed)
    if device.type == "cpu":
        torch.use_deterministic_algorithms(True)
    state = started(
        checkpoint.network_for(config, len(dataset.recipe.times), len(dataset.classes)).to(device), config
    )
    state.trained, state.judges = keys_of(dataset, numbers), keys_of(dataset, judges)
    run.mkdir(parents=True, exist_ok=True)
    resume(run, state, dataset, config)
    if compiling:
        state.forward = compiled(state.network, config, device)
    precision = "bf16" if uses_bfloat16(config.precision, device) else "fp32"
    data = f"{dataset.index.content_sha256} {dataset.index.splits_sha256}"
    team.check_same(f"data {data}, {config.to_json()}, {precision}, epoch {state.epoch}, step {state.step}")
    if team.leads:
        publish_config(run, config)
        publish_epoch(run, state, dataset, config)
    whole = config.passes * len(numbers)
    rate = learning_rate(config, state.epoch + state.seen / whole)
    report(_progress(state, rate))

    while not is_over(config, state.history):
        start, saved = time.perf_counter() - state.seconds, time.perf_counter()
        passes = range(state.epoch * config.passes, (state.epoch + 1) * config.passes)
        plan = [(drawn, step) for drawn in passes for step in steps_of(numbers, dataset.vertex_counts, config, drawn)]
        plan = plan[state.step :]
        of_passes = (
            meshes.batches([team.share(step) for _, step in steps], drawn)
            for drawn, steps in groupby(plan, itemgetter(0))
        )
        batches = Timed(chain.from_iterable(of_passes), state.waited)
        state.network.train()
        for (_, members), batch in zip(plan, batches, strict=True):
            if team.leads and time.perf_counter() - saved > SAVE_SECONDS:
                save(run / LAST, state, dataset, config)
                saved = time.perf_counter()
            rate = learning_rate(config, state.epoch + state.seen / whole)
            state.loss += _step(state, batch, members, meshes, rate, team)
            state.seen, state.step, state.updates = state.seen + len(members), state.step + 1, state.updates + 1
            state.seconds, state.waited = time.perf_counter() - start, batches.seconds
            report(_progress(state, rate))

        row: dict[str, Any] = {"epoch": state.epoch, "loss": state.loss / state.seen, "learning_rate": rate}
        row |= _judge(state, meshes, judges, team)
        row |= {"computed_in": precision, "compiled": compiling}
        row |= {"seconds": round(time.perf_counter() - start, 3), "waited": round(state.waited / state.seconds, 5)}
        state.end_epoch(row)
        if team.leads:
            save(run / LAST, state, dataset, config)
            publish_epoch(run, state, dataset, config)
        report(_progress(state, rate))
    return state.history


def _progress(state: State, rate: float) -> Progress:
    before = state.history[-1]["loss"] if state.history else math.nan
    loss = state.loss / state.seen if state.seen else before
    return Progress(epoch=state.epoch, meshes=state.seen, loss=loss, learning_rate=rate, history=state.history)


def _step(
    state: State, batch: Batch | None, members: Sequence[int], meshes: Meshes, rate: float, team: Team
) -> float:
    """One step of the optimiser, and the sum of the losses of its meshes. `batch`: those of this process, if any."""
    config = meshes.config
    for group in state.optimizer.param_groups:
        group["lr"] = rate
    state.optimizer.zero_grad()
    losses_B = torch.zeros(0, device=meshes.device)
    if batch is not None:
        with autocast(config.precision, meshes.device):
            vertex_logits = state.forward(*batch.network_inputs)
            logits = logits_of(vertex_logits, batch, config.task)
        losses_B = mesh_losses(logits, batch, config.task, config.label_smoothing, config.map_regularisation)
        (losses_B.sum() / len(members)).backward()
    total = losses_B.detach().sum()
    team.sum_([total, *_gradients(state.network)])
    length = torch.nn.utils.clip_grad_norm_(state.network.parameters(), config.clip_norm or math.inf)
    if not torch.isfinite(total + length):
        losses = {} if batch is None else dict(zip(batch.of_losses, losses_B.isfinite().tolist(), strict=True))
        bad = [numbers for part in team.gather(losses) for numbers, finite in part.items() if not finite]
        names = sorted({meshes.dataset.ids[number] for numbers in bad or [tuple(members)] for number in numbers})
        raise UsageError(
            f"epoch {state.epoch}: the {'loss' if bad else 'gradient of the loss'} is not finite on {names}; "
            "lower --learning-rate in another --run, or check these meshes with meshshard verify --full"
        )
    state.optimizer.step()
    state.follow(config.ema)
    return float(total)


def _gradients(network: torch.nn.Module) -> list[Tensor]:
    """Of all parameters; zeros where this process had no mesh."""
    for parameter in network.parameters():
        if parameter.grad is None:
            parameter.grad = torch.zeros_like(parameter)
    return [parameter.grad for parameter in network.parameters() if parameter.grad is not None]


def _judge(state: State, meshes: Meshes, numbers: Sequence[int], team: Team) -> dict[str, Any]:
    """Figures of an epoch on the split that chooses; `score`, of which the best epoch has most, is `judged_by`."""
    config = meshes.config
    network = copy.deepcopy(state.network)
    network.load_state_dict(state.weights())
    split = JUDGES[config.selection]
    if config.task == "correspondence":
        by, error = f"{split}_geodesic_error", evaluate_matching(network, meshes, numbers, team).mean()
        return {by: error, "score": -error, "judged_by": by, "protocol": config.protocol}
    rounds = [config.voting_rounds] if config.selection == "test" and config.task in VOTED else []
    found, by = evaluate(network, meshes, numbers, rounds, team), f"{split}_accuracy"
    row = {by: found.raw.accuracy(), f"{split}_mean_iou": found.raw.summary()["mean_iou"]}
    if rounds:
        by = f"{split}_voted_accuracy"
        row[by] = found.voted[config.voting_rounds].accuracy()
    return row | {"score": row[by], "judged_by": by, "protocol": config.protocol}
