"""Results as text: a sentence that says what they are, tables of figures, and results.md. Figures are in per cent."""

import math
from typing import Any

from meshshard_train.facts import said_of_training
from meshshard_train.metrics import CLASS_FIGURES, FIGURES

Rows = list[list[str]]
"""A head, and rows under it."""
WORDS = {
    "accuracy": "accuracy",
    "area_accuracy": "area accuracy",
    "mesh_accuracy": "mesh accuracy",
    "edge_accuracy": "edge accuracy",
    "class_accuracy": "class accuracy",
    "mean_iou": "mean IoU",
    "mean_dice": "mean Dice",
    "iou": "IoU",
    "dice": "Dice",
    "mesh_iou": "IoU by mesh",
    "mesh_dice": "Dice by mesh",
}
"""Figure -> its name in tables."""


def about(results: dict[str, Any]) -> str:
    """What goes with every figure: of what it is, and how epoch and rounds of voting were chosen."""
    voting = ""
    if "voted" in _kinds(results):
        count = results["voting_rounds"]
        voting = f", {count} round{'s' * (count != 1)} of voting{' (set by --rounds)' * results['rounds_set']}"
        voting += " with probabilities" * (results["config"].get("votes") == "probabilities")
        voting += " among neighbours only" * (not results["config"]["votes_itself"])
    learned = f"learned from {results['meshes_trained']} meshes"
    run = f"{results['dataset']}, recipe {results['recipe']}, {learned}, seed {results['seed']}"
    unfinished = "" if results.get("finished", True) else "; the run is not finished"
    return f"{run}: epoch {results['epoch']}{voting}; {results['protocol']}{said_of_training(results)}{unfinished}"


def main_table(results: dict[str, Any]) -> Rows:
    """A row for each figure, a column for each split, raw and voted."""
    kinds = _kinds(results)
    names = {kind: f" {kind}" if len(kinds) > 1 else "" for kind in kinds}
    prefixes = {"raw": "", "voted": "voted_"}
    rows = [["%", *(f"{split}{names[kind]}" for split in results["rows"] for kind in kinds)]]
    for figure in FIGURES[results["task"]]:
        values = [row[prefixes[kind] + figure] for row in results["rows"].values() for kind in kinds]
        rows.append([WORDS[figure], *map(per_cent, values)])
    return rows


def class_table(results: dict[str, Any], split: str, figures: tuple[str, ...] = CLASS_FIGURES) -> Rows:
    """A row for each class of a split, a column for each figure, raw and voted."""
    kinds = results["per_class"][split]
    figures = figures if len(kinds) > 1 else ("accuracy",)
    names = {kind: f" {kind}" if len(kinds) > 1 else "" for kind in kinds}
    rows = [["class", *(f"{WORDS[figure]}{names[kind]}" for figure in figures for kind in kinds)]]
    for name in results["classes"]:
        rows.append([name, *(per_cent(kinds[kind][name][figure]) for figure in figures for kind in kinds)])
    return rows


def markdown(results: dict[str, Any]) -> str:
    """results.md."""
    parts = [f"{about(results)}. Per cent.", markdown_table(main_table(results))]
    if missing := results["classes_not_trained"]:
        parts.append(not_trained(missing))
    for split in results["rows"]:
        parts += [f"## {split}", f"{results['protocol']}.", markdown_table(class_table(results, split))]
        parts.append(f"![Confusion matrix of {split}, {results['protocol']}](confusion-{split}.png)")
    return "\n\n".join(parts) + "\n"


def not_trained(classes: list[str]) -> str:
    """What is said of classes that no training mesh has."""
    return f"no training mesh has {', '.join(classes)}: these classes cannot be learned"


def per_cent(value: float | None) -> str:
    """Two decimals; a dash for what was not counted."""
    return "-" if value is None or math.isnan(value) else f"{100 * value:.2f}"


def _kinds(results: dict[str, Any]) -> list[str]:
    return list(next(iter(results["per_class"].values())))


def markdown_table(rows: Rows) -> str:
    """A head and rows as Markdown."""
    head, *rest = rows
    lines = [head, ["---", *["---:"] * (len(head) - 1)], *rest]
    return "\n".join(f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in line)} |" for line in lines)
