"""What prediction writes for a mesh: PLY, PNG and a label file, or the probabilities of its classes."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Int

from meshshard import Dataset, Sample, UsageError
from meshshard.export.ply import labelled_faces
from meshshard.files import publish
from meshshard.plain import to_json
from meshshard_train.checkpoint import Checkpoint
from meshshard_train.pictures import Tile, gallery
from meshshard_train.predict import predictions


def write_predictions(best: Checkpoint, dataset: Dataset, out: Path, device: torch.device) -> Iterator[str]:
    """Predict every sample of a data set and write its files into `out`; yields a line for each mesh.

    Segmentation: NAME.ply coloured by class, NAME.png, NAME.seg with a class index for each polygon of the mesh
    file, or, if the recipe simplifies, for each face of NAME.ply. Classification: NAME.json with the probability of
    every class. UsageError: features of another recipe.
    """
    made, learned = dataset.index.algorithm_version, best.state["algorithm_version"]
    if dataset.recipe != best.recipe or made != learned:
        raise UsageError(
            f"features by {dataset.recipe.to_json()}, algorithm {made}; the network learned {best.recipe.to_json()}, "
            f"algorithm {learned}: train anew, or install the meshshard it was trained with"
        )
    network = best.network().to(device)
    for number, labels, probabilities in predictions(network, dataset, range(len(dataset)), best.config, device):
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
        if best.recipe.simplify:
            write_lines(Path(f"{path}.seg"), labels)
        else:
            write_labels(Path(f"{path}.seg"), sample, labels)
        tile = Tile(title="", vertices=sample.vertices, faces=sample.faces, labels=labels)
        gallery(Path(f"{path}.png"), [tile], best.classes, columns=1, title=sample.id.split("/")[-1], size=6.0)
        counts = np.bincount(labels, minlength=len(best.classes))
        found = ", ".join(f"{name} {count}" for name, count in zip(best.classes, counts, strict=True) if count)
        counted = f" (.seg: a line for each face of {path}.ply)" if best.recipe.simplify else ""
        yield f"{sample.source}: faces of {found} -> {path}.ply, .png, .seg{counted}"


def write_labels(path: Path, sample: Sample, labels: Int[np.ndarray, " F"]) -> None:
    """One class index a line for every polygon of the mesh file, in its order: the commonest of its triangles, the
    lowest of equals; -1 where a step left all of them out."""
    votes = np.zeros((sample.polygons, int(labels.max()) + 1), dtype=np.int64)
    np.add.at(votes, (sample.face_source, labels), 1)
    write_lines(path, np.where(votes.any(axis=1), votes.argmax(axis=1), -1))


def write_lines(path: Path, labels: Int[np.ndarray, " n"]) -> None:
    """One class index a line."""
    publish(path, "".join(f"{label}\n" for label in labels).encode())
