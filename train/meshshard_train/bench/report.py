"""Figures of the benchmark as JSON and as a page."""

from pathlib import Path
from typing import Any

from meshshard.files import publish
from meshshard.plain import to_json

PAGE = """# Speed of training

Written by `make bench`: one run, the calls in turn, elapsed time, {threads} threads, medians of {rounds} rounds.
Generated meshes of 752 vertices and 1500 faces, with random features.

Processor: {processor}, {cores} cores, {load:.1f} processes at work on them at the end, this one's threads among them.
{versions}.

## A training step on the processor

Ours is recipe `paper`, which packs five such meshes into a step; they are prepared once and kept, {precision}. The
peer is the published loop, written plainly (`train/meshshard_train/bench/peer.py`): one mesh at a time in fp32, gradients of three accumulated, and every
mesh file read again for one vote among the faces across edges. It has the features in memory and our network.

| way | meshes a step | ms a mesh | least | times as fast as the peer | as it without voting | CPU ms | CPU ratio |
|---|---|---|---|---|---|---|---|
{training}

CPU is the time that all threads compute, medians too: other programs on the machine change it less.

## Voting

20 rounds on a mesh of 1500 faces, a fifth of its labels wrong: {ours_ms:.2f} ms, finding the neighbours included,
{found_ms:.2f} ms without.
3 rounds as in the published test pass, which reads the mesh file for each: {peer_ms:.0f} ms.

## Waiting for data

Share of a training step of recipe `paper` that is spent waiting for its batch.

| shards are | share |
|---|---|
{waiting}

## Starting

{starting}.
{gpu}"""

GPU = """
## On a GPU

{card}: {peak_tflops:.0f} TFLOPS in a large bf16 product. An epoch of 381 meshes, the data kept on the card.

| network | meshes a step | epoch, s | share of the peak |
|---|---|---|---|
{rows}
"""


def write(folder: Path, figures: dict[str, Any]) -> None:
    """`training.json` and `training.md` in `folder`."""
    folder.mkdir(parents=True, exist_ok=True)
    publish(folder / "training.json", (to_json(figures) + "\n").encode())
    publish(folder / "training.md", page(figures).encode())


def page(figures: dict[str, Any]) -> str:
    """The figures as Markdown."""
    gpu = figures["gpu"]
    return PAGE.format(
        **figures["machine"] | figures["voting"],
        versions=", ".join(f"{name} {version}" for name, version in figures["versions"].items()),
        training="\n".join(
            f"| {row['way']} | {row['meshes']} | {row['ms']:.0f} | {row['least_ms']:.0f} | "
            f"{row['ratio']:.2f} | {row['ratio_without_voting']:.2f} | {row['cpu_ms']:.0f} | {row['cpu_ratio']:.2f} |"
            for row in figures["training"]
        ),
        waiting="\n".join(f"| {name} | {100 * share:.2f} % |" for name, share in figures["waiting"].items()),
        starting=", ".join(f"{name}: {seconds:.2f} s" for name, seconds in figures["starting"].items()),
        gpu=""
        if gpu is None
        else GPU.format(
            **gpu
            | {
                "rows": "\n".join(
                    f"| {row['way']} | {row['meshes']} | {row['epoch_s']:.2f} | {100 * row['share']:.1f} % |"
                    for row in gpu["rows"]
                )
            }
        ),
    )
