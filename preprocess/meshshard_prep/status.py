"""What `status` and `features --dry-run` tell, as tables for JSON and as text."""

from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import joblib

from meshshard.files import holder
from meshshard.index import INDEX_NAME, Rejection, read_index
from meshshard.recipe import Recipe
from meshshard.remote import RemotePath
from meshshard_prep import staging
from meshshard_prep.datasets.layout import RawDataset
from meshshard_prep.estimate import estimate
from meshshard_prep.plan import make_plan


def stored(folder: Path) -> dict[str, Any]:
    """What a folder of shards holds, what was refused or failed, and who is writing to it."""
    table: dict[str, Any] = {"folder": str(folder), "stored": 0, "refused": 0, "failed": 0, "rejected": []}
    if (folder / INDEX_NAME).is_file():
        index = read_index(folder)
        table |= {
            "dataset": index.dataset,
            "recipe": index.recipe.name,
            "stored": len(index.ids),
            "refused": len(index.refused),
            "failed": len(index.failed),
            "shards": len(index.shards),
            "bytes": sum(entry.bytes for entry in index.shards),
            "rejected": _listed((*index.refused, *index.failed)),
        }
    held_by = "" if isinstance(folder, RemotePath) else holder(folder)  # a lock that was copied is none
    return table | {"waiting": len(staging.staged(folder)), "held_by": held_by}


def planned(dataset: RawDataset, folder: Path, recipe: Recipe, *, workers: int | None = None) -> dict[str, Any]:
    """What a run would do with each mesh, and why. With `workers` (n_jobs), also how long it would take and how much
    it would store: some meshes are computed for that, and nothing is written."""
    plan = make_plan(dataset, folder, recipe)
    table: dict[str, Any] = {
        "folder": str(folder),
        "meshes": len(dataset.entries),
        "fresh": plan.fresh,
        "stale_or_missing": len(plan.todo),
        "refused": len(plan.rejected),
        "gone": list(plan.gone),
        "reasons": dict(Counter(plan.todo.values())),
        "to_compute": plan.todo,
        "rejected": _listed(plan.rejected.values()),
    }
    if workers is not None:
        estimated = estimate([plan.jobs[name] for name in plan.todo], recipe)
        workers = min(joblib.effective_n_jobs(workers), max(len(plan.todo), 1))
        table |= {
            "workers": workers,
            "seconds": estimated.seconds / workers,
            "bytes": estimated.bytes,
            "trials": estimated.trials,
        }
    return table


def _listed(entries: Iterable[Rejection]) -> list[dict[str, str]]:
    return [{"id": entry.id, "code": entry.code, "message": entry.message} for entry in entries]


def as_text(table: dict[str, Any], missing: str) -> str:
    """The stored part a line for each figure, then the plan, or why there is none."""
    lines = [f"{name:9} {value}" for name, value in table.items() if name not in ("rejected", "plan", "held_by")]
    if table["held_by"]:
        lines.append(f"a run is writing to it: {table['held_by']}")
    lines += [f"  {entry['message']}" for entry in table["rejected"]]
    return "\n".join([*lines, plan_as_text(table["plan"]) if table["plan"] else missing])


def plan_as_text(table: dict[str, Any]) -> str:
    """A sentence for each thing a run would do."""
    lines = [
        f"{table['meshes']} meshes: {table['fresh']} fresh, {table['stale_or_missing']} to compute, "
        f"{table['refused']} refused as long as their files do not change -> {table['folder']}"
    ]
    lines += [f"{count:6} to compute: {reason}" for reason, count in table["reasons"].items()]
    if table["gone"]:
        lines.append(f"{len(table['gone']):6} to remove: no raw file any more, as {table['gone'][0]}")
    lines += [f"  {entry['message']}" for entry in table["rejected"]]
    if "seconds" in table:
        lines.append(
            f"about {table['seconds']:.1f} s with --jobs {table['workers']} and {table['bytes'] / 1e6:.1f} MB of "
            f"shards, judged by {table['trials']} meshes computed for the purpose; nothing was written"
        )
    return "\n".join(lines)
