"""What prediction writes for a mesh: PLY, PNG and a label file, or the probabilities of its classes."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import torch

from meshshard import Dataset, UsageError
from meshshard.export.ply import labelled_faces
from meshshard.files import publish
from meshshard.label_lines import SIMPLIFIED, as_lines, line_labels
from meshshard.plain import to_json
from meshshard_train.checkpoint import Checkpoint
from meshshard_train.loading import Loading, Meshes
from meshshard_train.pictures import Tile, gallery
from meshshard_train.predict import predictions


def write_predictions(best: Checkpoint, dataset: Dataset, out: Path, device: torch.device) -> Iterator[str]:
    """Predict every sample of a data set and write its files into `out`; yields a line for each mesh.

    Segmentation: NAME.ply coloured by class, NAME.png, NAME.seg with a class index a line, by `line_labels`.
    Classification: NAME.json with the probability of every class. UsageError: features of another recipe.
    """
    made, learned = dataset.index.algorithm_version, best.state["algorithm_version"]
    if dataset.recipe != best.recipe or made != learned:
        raise UsageError(
            f"features by {dataset.recipe.to_json()}, algorithm {made}; the network learned {best.recipe.to_json()}, "
            f"algorithm {learned}: train anew, or install the meshshard it was trained with"
        )
    network, meshes = best.network().to(device), Meshes(dataset, best.config, device, Loading())
    for number, labels, probabilities in predictions(network, meshes, range(len(dataset))):
        sample = dataset[number]
        path = out / sample.id
        path.parent.mkdir(parents=True, exist_ok=True)
        if best.config.task == "classification":
            table = dict(zip(best.classes, probabilities[0].tolist(), strict=True))
            name = f"{path}.json"
            publish(Path(name), to_json(table).encode() + b"\n")
            yield f"{sample.source}: {best.classes[labels[0]]} ({100 * probabilities.max():.1f} %) -> {name}"
            continue
        publish(Path(f"{path}.ply"), labelled_faces(sample, labels))
        publish(Path(f"{path}.seg"), as_lines(line_labels(sample, labels, best.recipe)))
        tile = Tile(title="", vertices=sample.vertices, faces=sample.faces, labels=labels)
        gallery(Path(f"{path}.png"), [tile], best.classes, columns=1, title=sample.id.split("/")[-1], size=6.0)
        counts = np.bincount(labels, minlength=len(best.classes))
        found = ", ".join(f"{name} {count}" for name, count in zip(best.classes, counts, strict=True) if count)
        counted = f" (.seg: {SIMPLIFIED})" if best.recipe.simplify else ""
        yield f"{sample.source}: faces of {found} -> {path}.ply, .png, .seg{counted}"
