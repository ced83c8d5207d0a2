"""The report of a run, and of the runs of several seeds, put together."""

import json
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import torch

from meshshard import Dataset, UsageError, open_dataset
from meshshard.commands import locate
from meshshard.data_card.card import data_card
from meshshard.data_card.page import card_parts, fill
from meshshard.data_card.survey import survey
from meshshard.data_card.tables import shown
from meshshard.files import sha256_of_file
from meshshard.remote import to_path
from meshshard_train import checkpoint, matching_results, seeds, tables
from meshshard_train.checkpoint import Checkpoint
from meshshard_train.members import JUDGES
from meshshard_train.report.charts import Line, chart
from meshshard_train.report.meshes import worst_and_best
from meshshard_train.report.parts import confusion, cost, curves, facts, history_of, origin, sheet_of
from meshshard_train.results import RESULTS, is_finished
from meshshard_train.state import BEST, METRICS

PACKAGE = "meshshard_train.report"


@dataclass(frozen=True)
class Report:
    """The page, and a line for each part that is not in it, with what to type."""

    page: str
    missing: list[str]


def run_report(run: Path, data: str | None, count: int, device: torch.device) -> Report:
    """All of a run. `data`: where its data set is, if not where it was; `count`: how many meshes are shown.

    UsageError: no best.safetensors, a file of the run that cannot be read, or `data` is another data set.
    """
    best = checkpoint.load(run / BEST)
    dataset, missing = _data_of(best, data)
    history = history_of(run)
    if not history:
        missing.append(f"{run / METRICS} is not there: no curves; meshshard train writes it when it goes on")
    values = _blank() | {
        "title": f"Run {shown(run.resolve().name)}",
        "curves": curves({"": history}, {"best": best.state["epoch"]}),
        "settings": facts("Settings", asdict(best.config)),
    }
    if is_finished(run):
        results = _read(run / RESULTS)
        values |= _checked(run / RESULTS, lambda: _figures(results) | {"cost": cost(results)})
        split, sha256 = list(results["rows"])[-1], results["checkpoint_sha256"]
    else:
        split, sha256 = JUDGES[best.config.selection], sha256_of_file(run / BEST)
        results = {"splits_sha256": best.splits_sha256, "content_sha256": best.content_sha256}
        values["about"] = shown(
            f"{best.state['dataset']}, recipe {best.config.recipe}, seed {best.config.seed}, not finished: "
            f"{len(history)} of {best.config.epochs} epochs done, the best is {best.state['epoch']}"
        )
        missing.append(
            f"{run} is not finished: no figures, and pictures are of {split}; go on with meshshard train, the same "
            "settings and --run, and write the report again"
        )
    values |= origin(run.resolve(), sha256, results, dataset)
    if best.config.task == "correspondence":
        missing.append("correspondence has no classes: no pictures of meshes with labels beside predictions")
    elif dataset is not None and count:
        values["meshes"] = worst_and_best(best, run, dataset, dataset.splits.get(split, ()), count, device)
        values["split"], values["protocol"] = split, best.config.protocol
    return _filled(values, dataset, missing)


def seeds_report(folder: Path, data: str | None) -> Report:
    """Mean, deviation and every run of several seeds, their curves, and what they have in common. UsageError as for
    `run_report`."""
    path = folder / seeds.SEEDS
    summary = _read(path)
    values = _checked(path, lambda: _of_seeds(folder, summary))
    missing: list[str] = []
    for seed, result in zip(summary["seeds"], summary["runs"], strict=True):
        run = seeds.folder_of(folder, seed)
        if not (run / BEST).exists() or sha256_of_file(run / BEST) != result["checkpoint_sha256"]:
            missing.append(
                f"{run / BEST} is not the checkpoint that the figures of seed {seed} are of: meshshard train with "
                "the same --run and --seeds makes both again"
            )
        if not (run / METRICS).exists():
            missing.append(f"{run / METRICS} is not there: no curves of seed {seed}")
    first = seeds.folder_of(folder, summary["seeds"][0])
    missing.append(f"pictures of meshes are in the report of one seed: meshshard report {first} --out FILE.html")
    dataset = None
    if (first / BEST).exists():
        dataset, gone = _data_of(checkpoint.load(first / BEST), data)
        missing += gone
    else:
        missing.append(f"no data card: {first / BEST}, which says where the data is, is not there")
    values |= origin(folder.resolve(), "of each run, above", summary["runs"][0], dataset)
    return _filled(values, dataset, missing)


def _blank() -> dict[str, Any]:
    parts = (
        "about",
        "results",
        "classes",
        "confusions",
        "curves",
        "meshes",
        "cost",
        "runs",
        "split",
        "protocol",
        "errors",
    )
    return dict.fromkeys(parts, ())


def _filled(values: dict[str, Any], dataset: Dataset | None, missing: list[str]) -> Report:
    values |= {"missing": [shown(line) for line in missing], "card": None, "shards": values.get("shards")}
    if dataset is not None:
        seen = survey(dataset)
        values |= card_parts(dataset, seen, data_card(dataset, seen), level=3) | {"card": shown(dataset.name)}
    return Report(fill("report.html", (PACKAGE,), values), missing)


def _data_of(best: Checkpoint, data: str | None) -> tuple[Dataset | None, list[str]]:
    """The data set that a run learned from; or none, and why. UsageError: `data` is another."""
    where = data or best.state["folder"]
    if data is None and not to_path(where).exists():
        return None, [f"the data set is not at {where}: no data card and no pictures; say where it is with --data"]
    dataset = open_dataset(locate(where))
    if others := best.other_data(dataset):
        wrong = f"{dataset.folder} is not what the run was trained on: {'; '.join(others)}"
        if data is not None:
            raise UsageError(f"--data: {wrong}; name the folder of that data set, or leave --data out")
        return None, [f"{wrong}. No data card and no pictures; say where that data is with --data"]
    return dataset, []


def _read(path: Path) -> Any:
    try:
        return json.loads(path.read_bytes())
    except (OSError, ValueError, RecursionError) as error:
        raise UsageError(
            f"{path} cannot be read ({error}): go on with meshshard train, which writes it anew"
        ) from error


def _checked(path: Path, parts: Callable[[], dict[str, Any]]) -> dict[str, Any]:
    """UsageError: a table is not in the file as this version writes it."""
    try:
        return parts()
    except (KeyError, TypeError, ValueError, IndexError, AttributeError) as error:
        raise UsageError(
            f"{path} is not as this version writes it ({error!r}): meshshard train with the same settings and --run "
            "writes it anew"
        ) from error


def _figures(results: dict[str, Any]) -> dict[str, Any]:
    if results["task"] == "correspondence":
        return _of_matching(results)
    values: dict[str, Any] = {
        "about": shown(tables.about(results)),
        "results": [sheet_of(f"All figures, per cent; {results['protocol']}", tables.main_table(results))],
        "classes": [
            sheet_of(f"{split}, each class, per cent; {results['protocol']}", tables.class_table(results, split))
            for split in results["rows"]
        ],
        "confusions": [
            confusion(counts, results["classes"], f"{split}, {kind}; {results['protocol']}")
            for split, kinds in results["confusion"].items()
            for kind, counts in kinds.items()
        ],
    }
    if missing := results["classes_not_trained"]:
        values["about"] += "; " + shown(tables.not_trained(missing))
    return values


def _of_matching(results: dict[str, Any]) -> dict[str, Any]:
    rows, at = matching_results.matching_table(results), results["thresholds"]
    lines = [
        Line(split, [(error, 100 * share) for error, share in zip(at, row["shares"], strict=True)])
        for split, row in results["rows"].items()
    ]
    title = f"Points within an error, per cent; {results['protocol']}"
    return {
        "about": shown(matching_results.about(results)),
        "results": [sheet_of(f"Geodesic errors; {results['protocol']}", rows)],
        "errors": chart(title, "geodesic error / square root of area", lines),
    }


def _of_seeds(folder: Path, summary: dict[str, Any]) -> dict[str, Any]:
    runs = [["seed", "folder", "hours", "finished on", "checkpoint_sha256"]]
    histories, chosen = {}, {}
    for seed, result in zip(summary["seeds"], summary["runs"], strict=True):
        run = seeds.folder_of(folder, seed)
        hours = f"{result['seconds'] / 3600:.2f}"
        machine = result.get("finished_on", "not recorded")
        runs.append([str(seed), run.name, hours, machine, result["checkpoint_sha256"]])
        histories[f"seed {seed}"] = history_of(run)
        chosen[f"best of {seed}"] = float(result["epoch"])
    settings = summary["runs"][0]["config"] | {"seed": summary["seeds"]}
    return _blank() | {
        "title": f"Runs {shown(folder.resolve().name)}",
        "about": shown(seeds.about(summary)),
        "results": [
            sheet_of(f"Mean, deviation (n - 1) and every run; {summary['protocol']}", seeds.table_rows(summary))
        ],
        "runs": sheet_of("Every run", runs),
        "curves": curves(histories, chosen if len(chosen) == 1 else {}),
        "settings": facts("Settings", settings),
    }
