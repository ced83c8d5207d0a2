"""What is measured on a GPU: an epoch as large as that of `human_seg`, and how near it comes to the card's peak."""

import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import torch

from meshshard_train.bench.measure import our_state, packing
from meshshard_train.bench.shapes import write_shards
from meshshard_train.data import steps_of
from meshshard_train.loading import Loading, Meshes
from meshshard_train.loop import _step
from meshshard_train.model import TaskDrivenNet
from meshshard_train.team import Team

MESHES = 381
"""Training meshes of `human_seg`."""
PACKED = (2, 20, 64)
WAYS: dict[str, Callable[[TaskDrivenNet], None]] = {
    "as it is": lambda network: None,  # noqa: ARG005
    "torch.compile": lambda network: network.compile(dynamic=False),
    "torch.compile, CUDA graphs": lambda network: network.compile(dynamic=False, mode="reduce-overhead"),
}


def on_gpu(rounds: int = 5) -> dict[str, Any]:
    """Seconds of an epoch by meshes a step and by way of running the network, and its share of the peak in bf16."""
    device = torch.device("cuda")
    peak = matmul_peak(device)
    with tempfile.TemporaryDirectory() as name:
        dataset = write_shards(Path(name), MESHES)
        rows = []
        for count in PACKED:
            for way, change in WAYS.items():
                config = packing(dataset, count)
                meshes, state = Meshes(dataset, config, device, Loading()), our_state(dataset, config, device)
                change(state.network)
                weights = sum(p.numel() for p in state.network.parameters() if p.ndim == 2)
                spent = []
                for epoch in range(rounds + 2):  # the first prepares and compiles, the second meets the last shapes
                    torch.cuda.synchronize()
                    start = time.perf_counter()
                    plan = steps_of(dataset.splits["train"], dataset.vertex_counts, config, epoch)
                    for members, batch in zip(plan, meshes.batches(plan, epoch), strict=True):
                        _step(state, batch, members, meshes, config.learning_rate, Team())
                    torch.cuda.synchronize()
                    spent.append(time.perf_counter() - start)
                seconds = statistics.median(spent[2:])
                done = 6 * weights * sum(dataset.vertex_counts)  # twice forward, four times backward
                rows.append({"way": way, "meshes": count, "epoch_s": seconds, "share": done / seconds / peak})
    return {"card": torch.cuda.get_device_name(device), "peak_tflops": peak / 1e12, "rows": rows}


def matmul_peak(device: torch.device, size: int = 8192) -> float:
    """Operations a second of a large bf16 matrix product: the best of ten."""
    a = torch.randn(size, size, dtype=torch.bfloat16, device=device)
    best = float("inf")
    for _ in range(10):
        torch.cuda.synchronize()
        start = time.perf_counter()
        a @ a
        torch.cuda.synchronize()
        best = min(best, time.perf_counter() - start)
    return 2 * size**3 / best
