"""meshshard bench-train: how fast training is."""

from pathlib import Path
from typing import Annotated, Any

import typer

from meshshard.commands import AsJson
from meshshard.plain import to_json
from meshshard_train.commands.shared import Device, wait_quietly


def bench_train(
    out: Annotated[Path, typer.Option(help="Folder for the table.")] = Path("docs/benchmarks"),
    threads: Annotated[int, typer.Option(help="Threads of the processor.", min=1)] = 2,
    rounds: Annotated[int, typer.Option(help="Rounds that medians are taken of.", min=1)] = 9,
    compiling: Annotated[
        bool, typer.Option("--compile", help="Measure the compiled network too: minutes more.")
    ] = False,
    device: Device = "auto",
    as_json: AsJson = False,
) -> None:
    """Measure training beside the published loop, voting, waiting for data and starting; an epoch on a GPU, if any.

    Example: meshshard bench-train --rounds 3 --out /tmp/bench
    """
    wait_quietly()
    import os
    import tempfile
    from importlib.metadata import version

    import torch

    from meshshard.machine import processor
    from meshshard_train.bench import measure, report, shapes
    from meshshard_train.device import choose_device, uses_bfloat16

    where = choose_device(device)
    torch.set_num_threads(threads)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        dataset = shapes.write_shards(folder, meshes=60)
        figures: dict[str, Any] = {
            "versions": {library: version(library) for library in ("torch", "numpy", "scipy")},
            "training": measure.training(dataset, folder, rounds, compiling=compiling),
            "voting": measure.voting(folder, rounds),
            "waiting": measure.waiting(dataset, steps=30),
            "starting": measure.starting(rounds),
        }
    figures["gpu"] = None
    if where.type == "cuda":
        from meshshard_train.bench.gpu import on_gpu

        figures["gpu"] = on_gpu()
    figures["machine"] = {
        "processor": processor(),
        "cores": os.cpu_count(),
        "load": os.getloadavg()[0],
        "threads": threads,
        "rounds": rounds,
        "precision": "bf16" if uses_bfloat16("auto", torch.device("cpu")) else "fp32",
    }
    report.write(out, figures)
    typer.echo(to_json(figures) if as_json else report.page(figures))
