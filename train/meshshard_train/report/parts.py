"""Parts of a report that follow from a run's files alone: tables, curves, and who is taken for whom."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from meshshard import Dataset, UsageError, __version__
from meshshard.data_card.tables import Table, shown
from meshshard_train.metrics import judged
from meshshard_train.report.charts import Line, chart
from meshshard_train.state import METRICS
from meshshard_train.tables import Rows

SHARDS = 50
"""That are listed by name, at most."""


def history_of(run: Path) -> list[dict[str, Any]]:
    """The lines of metrics.jsonl, none without the file. UsageError: one cannot be read."""
    path = run / METRICS
    if not path.exists():
        return []
    history: list[dict[str, Any]] = []
    for number, line in enumerate(path.read_bytes().splitlines(), start=1):
        try:
            row = json.loads(line)
            name, value = judged(row)
            history.append(
                {
                    "epoch": int(row["epoch"]),
                    "loss": float(row["loss"]),
                    "learning_rate": float(row["learning_rate"]),
                    "name": name,
                    "value": float(value),
                    "iou": _iou(row),
                }
            )
        except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
            raise UsageError(
                f"{path}, line {number}, cannot be read ({error!r}): meshshard train with the same settings writes "
                "the file anew"
            ) from error
    return history


def _iou(row: Mapping[str, Any]) -> tuple[str, float] | None:
    found = [(name, float(value)) for name, value in row.items() if name.endswith("_mean_iou")]
    return found[0] if found else None


def curves(
    histories: Mapping[str, Sequence[Mapping[str, Any]]], chosen: Mapping[str, float | int]
) -> list[dict[str, Any]]:
    """Charts of loss, of what chooses the epoch, and of the learning rate, over epochs. `histories`: by the name of a
    run, "" for one alone; `chosen`: what stands at which epoch."""
    named = {name: rows for name, rows in histories.items() if rows}
    if not named:
        return []
    first = next(iter(named.values()))[0]
    figure = first["name"]
    unit = "per cent" if first["iou"] else "hundredths of the square root of the area"
    right = [
        Line(name or figure, [(row["epoch"], 100 * row["value"]) for row in rows]) for name, rows in named.items()
    ]
    if first["iou"] and "" in named:
        label = first["iou"][0].replace("_", " ").replace("iou", "IoU")
        right.append(Line(label, [(row["epoch"], 100 * row["iou"][1]) for row in named[""]]))
    return [
        chart("Training loss", "epoch", _lines(named, "loss", "training loss"), chosen),
        chart(f"{figure[0].upper()}{figure[1:]}, {unit}", "epoch", right, chosen),
        chart("Learning rate", "epoch", _lines(named, "learning_rate", "learning rate"), chosen),
    ]


def _lines(named: Mapping[str, Sequence[Mapping[str, Any]]], key: str, words: str) -> list[Line]:
    return [Line(name or words, [(row["epoch"], row[key]) for row in rows]) for name, rows in named.items()]


def sheet_of(title: str, rows: Rows) -> Table:
    """Rows with a head as a table."""
    head, *rest = ([shown(cell) for cell in row] for row in rows)
    return Table(shown(title), tuple(head), tuple(map(tuple, rest)))


def facts(title: str, lines: Mapping[str, object]) -> Table:
    """Names and values as a table."""
    return Table(title, (), tuple((shown(name), _words(value)) for name, value in lines.items()))


def _words(value: object) -> str:
    if isinstance(value, tuple | list):
        return shown(", ".join(map(str, value)) or "none")
    return "none" if value == "" else "yes" if value is True else "no" if value is False else shown(value)


def confusion(counts: Sequence[Sequence[int]], classes: Sequence[str], title: str) -> dict[str, Any]:
    """What `confusion` of `report.html` draws: of each true class how many per cent were predicted as which."""
    rows = []
    for true, row in enumerate(counts):
        total = sum(row)
        rows.append(
            {
                "name": shown(classes[true]),
                "total": f"{total:,}",
                "cells": [
                    {
                        "text": _share(count, total),
                        "shade": f"{count / total:.3f}" if total else "0",
                        "right": predicted == true,
                    }
                    for predicted, count in enumerate(row)
                ],
            }
        )
    return {"title": shown(title), "header": [shown(name) for name in classes], "rows": rows}


def _share(count: int, total: int) -> str:
    if not count:
        return "-" if not total else ""
    return "<1" if count / total < 0.005 else f"{100 * count / total:.0f}"


def origin(run: Path, sha256: str, results: Mapping[str, Any], dataset: Dataset | None) -> dict[str, Table]:
    """What figures are of, and how long they took: hashes, hours, hardware; and the shards, where they are there."""
    hashes = {
        "folder of the run": run,
        "sha256 of best.safetensors": sha256,
        "splits_sha256": results["splits_sha256"],
        "content_sha256": results["content_sha256"],
        "report written by": f"meshshard {__version__}",
    }
    found = {"hashes": facts("Hashes", hashes)}
    if dataset is not None:
        shards = dataset.index.shards
        rows = [["shard", "meshes", "bytes", "sha256"]]
        rows += [[shard.file, f"{shard.meshes:,}", f"{shard.bytes:,}", shard.sha256] for shard in shards[:SHARDS]]
        rows += [[f"{len(shards) - SHARDS:,} more are in index.json", "", "", ""]] * (len(shards) > SHARDS)
        found["shards"] = sheet_of("Shards", rows)
    return found


def cost(results: Mapping[str, Any]) -> Table:
    """How long a finished run took, and on what."""
    return facts(
        "Time and hardware",
        {
            "epochs": results["epochs"],
            "hours": f"{results['seconds'] / 3600:.2f}",
            "computed in": ", ".join(results["computed_in"]) + ", compiled" * results["compiled"],
            "finished on": results.get("finished_on", "not recorded: the run is of an earlier version"),
        },
    )
