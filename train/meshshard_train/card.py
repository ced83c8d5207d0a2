"""The model card of a finished run: facts about its data, its training, its figures and its limits, as Markdown."""

import platform
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import torch

from meshshard import Dataset, __version__
from meshshard.data_card.card import recipe_words
from meshshard.data_card.tables import shown
from meshshard.files import publish, sha256_of_file
from meshshard_train.checkpoint import Checkpoint
from meshshard_train.config import TrainConfig
from meshshard_train.inputs import TURNED
from meshshard_train.members import training_numbers
from meshshard_train.state import BEST

CARD = "model_card.md"
GIVES = {
    "segmentation": "a class for each face",
    "vertex_segmentation": "a class for each vertex",
    "classification": "one class",
    "correspondence": "functional coordinates for each vertex",
}
"""Task -> what the network gives for a triangle mesh."""


def write_card(run: Path, best: Checkpoint, dataset: Dataset, results: dict[str, Any], device: torch.device) -> None:
    """Write `model_card.md` into the folder of a run. `results`: the content of results.json."""
    sha256 = sha256_of_file(run / BEST)
    publish(run / CARD, card_text(best, dataset, results, sha256, hardware(device)).encode())


def hardware(device: torch.device) -> str:
    """What this process computes on, in words."""
    if device.type == "cuda":
        return torch.cuda.get_device_name(device)
    return f"processor ({platform.machine()}), {torch.get_num_threads()} threads"


def card_text(best: Checkpoint, dataset: Dataset, results: dict[str, Any], sha256: str, machine: str) -> str:
    """The card. Names from files can break neither its lines nor its tables."""
    index, config = dataset.index, best.config
    numbers = training_numbers(dataset, config)
    counts = [dataset.vertex_counts[number] for number in numbers]
    others = {split: len(dataset.splits.get(split, ())) for split in ("val", "test")}
    return "\n".join(
        [
            f"# Model card: {_plain(dataset.name)}, recipe {config.recipe}",
            "",
            f"Takes a triangle mesh and gives {GIVES[config.task]}. The network of [A Task-driven Network for Mesh "
            "Classification and Semantic Part Segmentation](https://arxiv.org/abs/2306.05246) with normalisation "
            f"{config.normalisation} and backbone {config.backbone}, trained with meshshard.",
            "",
            "## Data",
            *_table(
                {
                    "data set": dataset.name,
                    "licence": index.licence or "not stated",
                    "citation": index.citation or "not stated",
                    "meshes trained on": f"{len(numbers)}, of {min(counts)} to {max(counts)} vertices",
                    "meshes of val and test": f"{others['val']} and {others['test']}",
                    "meshes refused or failed": len(index.refused) + len(index.failed),
                    "splits": f"{index.split_rule}, seed {index.split_seed}",
                    "classes": ", ".join(best.classes) or "none",
                    "content_sha256": best.content_sha256,
                    "splits_sha256": best.splits_sha256,
                }
                | {f"note {place}": note for place, note in enumerate(index.notes, start=1)}
            ),
            "## Input",
            *_table(
                {
                    "features": ", ".join(config.features),
                    "recipe of the features": f"{best.recipe.name}: {recipe_words(best.recipe)}",
                    "algorithm version": index.algorithm_version,
                }
            ),
            "## Training",
            *_table(
                {name: _words(value) for name, value in asdict(config).items()}
                | {
                    "epochs done": results["epochs"],
                    "epoch that is kept": results["epoch"],
                    "rounds of voting": results.get("voting_rounds", "none"),
                    "hours": f"{results['seconds'] / 3600:.2f}",
                    "computed in": ", ".join(results["computed_in"]) + ", compiled" * results["compiled"],
                    "finished on": machine,
                    "torch": torch.__version__,
                    "meshshard": __version__,
                    f"sha256 of {BEST}": sha256,
                }
            ),
            "## Results",
            "",
            f"{config.protocol[0].upper()}{config.protocol[1:]}. As in results.json: shares of 1, or geodesic errors "
            "over the square root of the area.",
            *_figures(results["rows"]),
            "## Use and limits",
            "",
            *(
                f"* {_plain(line)}"
                for line in limits(dataset, config, counts, results.get("classes_not_trained", ()))
            ),
            "",
        ]
    )


def limits(dataset: Dataset, config: TrainConfig, counts: list[int], missing: Sequence[str]) -> list[str]:
    """What the network can be used for and what not, as far as it follows from its data and settings. `counts`: of
    vertices of the training meshes; `missing`: classes that none of them has."""
    lines = [
        f"Use: {GIVES[config.task]}, for meshes like those of {dataset.name}, with features of the recipe above "
        "(`meshshard predict` computes them).",
        f"It learned from meshes of {min(counts)} to {max(counts)} vertices.",
    ]
    if missing:
        lines.append(f"No training mesh has {', '.join(missing)}: these classes were not learned.")
    if not set(TURNED) & set(config.features):
        lines.append("Its features do not depend on how a mesh is turned.")
    elif config.rotation_axes:
        axes = ", ".join(config.rotation_axes)
        lines.append(f"In training meshes were turned by quarter turns about {axes}, and not otherwise.")
    else:
        lines.append("In training meshes were not turned: it knows the orientations that the data has.")
    lines.append("Units do not matter: every mesh is centred and divided by its largest distance from the centre.")
    if config.train_fraction < 1:
        lines.append(f"It learned from a share of {config.train_fraction:g} of the training split.")
    if config.selection == "test":
        lines.append("The test split chose the epoch: its figures are not those of meshes it has never met.")
    elif not dataset.splits.get("test"):
        lines.append("There is no test split: all figures are of meshes that chose the epoch.")
    return lines


def _words(value: object) -> object:
    return ", ".join(map(str, value)) if isinstance(value, tuple) else value if value != "" else "none"


def _figures(rows: dict[str, dict[str, Any]]) -> list[str]:
    """A line for each figure that is one number, a column for each split."""
    names = dict.fromkeys(name for row in rows.values() for name, value in row.items() if isinstance(value, float))
    table = {
        name.replace("_", " "): [f"{row[name]:.4f}" if name in row else "" for row in rows.values()] for name in names
    }
    return _table(table, head=["figure", *rows])


def _table(lines: dict[str, Any], head: Iterable[str] = ("", "")) -> list[str]:
    """Lines of a Markdown table, with empty ones around it."""
    cells = [list(head), *([name, *(value if isinstance(value, list) else [value])] for name, value in lines.items())]
    cells.insert(1, ["---"] * len(cells[0]))
    return ["", *(f"| {' | '.join(map(_plain, line))} |" for line in cells), ""]


def _plain(text: object) -> str:
    """One line that is neither HTML nor the end of a cell."""
    return shown(text).replace("<", "&lt;").replace("|", "\\|")
