"""What a finished run for correspondence leaves for people: results.json, results.md, and a picture of its curves."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import torch
from matplotlib.figure import Figure

from meshshard import Dataset
from meshshard.files import publish, sha256_of_file
from meshshard.palette import class_colour
from meshshard.plain import to_json
from meshshard_train.card import hardware, write_card
from meshshard_train.checkpoint import Checkpoint
from meshshard_train.facts import facts_of, of_history, said_of_training
from meshshard_train.loading import Loading, Meshes
from meshshard_train.matching import THRESHOLDS, evaluate_matching, evaluate_true_maps
from meshshard_train.members import split_of
from meshshard_train.pictures import plot_loss, save_figure
from meshshard_train.state import BEST
from meshshard_train.tables import markdown_table

HEAD = ("split", "mean error", "of true maps", "to 0.05, %", "to 0.10, %", "to 0.25, %")


def write_matching_results(
    best: Checkpoint,
    dataset: Dataset,
    run: Path,
    history: Sequence[dict[str, Any]],
    device: torch.device,
    loading: Loading = Loading(),
) -> tuple[dict[str, Any], list[Path]]:
    """Evaluate the best epoch on validation, then once on test; write results and picture, and name the picture."""
    splits = ["val"] * (best.config.selection == "validation") + ["test"] * bool(dataset.splits.get("test"))
    results = matching_results(best, dataset, splits, device, loading)
    results |= {
        **of_history(history),
        "checkpoint_sha256": sha256_of_file(run / BEST),
        "finished_on": hardware(device),
    }
    publish(run / "results.json", to_json(results).encode() + b"\n")
    publish(run / "results.md", _markdown(results).encode())
    write_card(run, best, dataset, results, device)
    _draw(run / "curves.png", results, history)
    return results, [run / "curves.png"]


def matching_results(
    best: Checkpoint, dataset: Dataset, splits: Sequence[str], device: torch.device, loading: Loading = Loading()
) -> dict[str, Any]:
    """Errors of some splits: the mean, that of the maps of the known correspondence (which no network with so few
    eigenfunctions can be expected to beat), and the shares of points with errors up to `thresholds`."""
    meshes, network = Meshes(dataset, best.config, device, loading), best.network().to(device)
    rows = {}
    for split in splits:
        numbers = split_of(dataset, split)
        errors = evaluate_matching(network, meshes, numbers)
        rows[split] = {
            "geodesic_error": errors.mean(),
            "true_map_error": evaluate_true_maps(meshes, numbers).mean(),
            "points": errors.count,
            "shares": errors.curve(),
        }
    return facts_of(best, dataset, splits) | {
        "protocol": best.config.protocol,
        "eigenfunctions": best.config.eigenfunctions,
        "thresholds": THRESHOLDS.tolist(),
        "rows": rows,
    }


def matching_table(results: dict[str, Any]) -> list[list[str]]:
    """Head and rows of the table: errors in hundredths of the square root of the area, shares of points in %."""
    lines = [list(HEAD)]
    for split, row in results["rows"].items():
        share_of = dict(zip([f"{value:.3f}" for value in results["thresholds"]], row["shares"], strict=True))
        figures = [
            row["geodesic_error"],
            row["true_map_error"],
            *(share_of[at] for at in ("0.050", "0.100", "0.250")),
        ]
        lines.append([split, *(f"{100 * figure:.2f}" for figure in figures)])
    return lines


def about(results: dict[str, Any]) -> str:
    """What the figures are of, and how the epoch was chosen."""
    run = f"{results['dataset']}, recipe {results['recipe']}, seed {results['seed']}, epoch {results['epoch']}"
    how = f"{results['protocol']}{said_of_training(results)}"
    return f"{run}; {how}. Geodesic errors in hundredths of the square root of the area"


def _markdown(results: dict[str, Any]) -> str:
    return f"{about(results)}; points in per cent.\n\n{markdown_table(matching_table(results))}\n"


def _draw(path: Path, results: dict[str, Any], history: Sequence[dict[str, Any]]) -> None:
    """Training loss and error over epochs, and the shares of points by error."""
    error = next(name for name in history[0] if name.endswith("geodesic_error"))
    epochs = [row["epoch"] for row in history]
    with mpl.rc_context({"axes.grid": True, "grid.alpha": 0.3}):
        figure = Figure(figsize=(11, 3.2), layout="constrained")
        figure.suptitle(about(results), fontsize="medium")
        left, middle, right = figure.subplots(1, 3)
        plot_loss(left, history)
        middle.plot(epochs, [100 * row[error] for row in history], color=class_colour(3))
        middle.set(xlabel="epoch", ylabel=error.replace("_", " "), ylim=(0, None))
        for number, (split, row) in enumerate(results["rows"].items()):
            shares = [100 * share for share in row["shares"]]
            right.plot(results["thresholds"], shares, color=class_colour(number), label=split)
        right.legend(loc="lower right")
        right.set(xlabel="geodesic error / square root of area", ylabel="points, %", ylim=(0, 100))
        save_figure(figure, path)
