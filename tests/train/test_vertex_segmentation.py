"""Labels of vertices on their whole way: a data set in IntrA's published layout, from files to labels of new ones."""

import numpy as np
import pytest
import torch
from light import LIGHT
from shapes import bumpy, write_obj

from meshshard import open_dataset
from meshshard_prep.datasets import Draw, read_dataset
from meshshard_prep.run import run
from meshshard_train import checkpoint
from meshshard_train.labelling import known_rounds, label_meshes, outputs_of
from meshshard_train.loop import train
from meshshard_train.prediction_inputs import features_of, source_names
from meshshard_train.recipes import paper
from meshshard_train.results import write_results
from meshshard_train.tasks import task_of

CPU = torch.device("cpu")


def write_intra(root, count=10):
    """Segments whose upper part is aneurysm, with a boundary; five folds; an unused vertex, which has a label too."""
    (root / "fileSplit" / "seg").mkdir(parents=True)
    (root / "annotated" / "ad").mkdir(parents=True)
    folds = [[] for _ in range(5)]
    for number in range(count):
        vertices, faces = bumpy(number, 1)
        vertices = np.vstack([vertices, [[9.0, 9, 9]]])
        labels = np.digitize(vertices[:, 1], [0.1, 0.5])
        labels = np.array([0, 2, 1])[labels]
        write_obj(root / "annotated" / "obj" / f"AN{number}_full.obj", vertices, faces)
        rows = np.column_stack([vertices, vertices, labels])
        np.savetxt(root / "annotated" / "ad" / f"AN{number}-_norm.ad", rows, fmt=[*["%.6f"] * 6, "%d"])
        folds[number % 5].append(f"annotated/ad/AN{number}-_norm.ad\n")
    for number, lines in enumerate(folds):
        (root / "fileSplit" / "seg" / f"annSplit_{number}.txt").write_text("".join(lines))
    return root


def test_intra_from_its_files_to_labels_of_new_meshes(tmp_path):
    raw = write_intra(tmp_path / "raw")
    assert run(read_dataset("intra", raw, draw=Draw(fold=1)), tmp_path / "shards", LIGHT, jobs=1, val_fraction=0.3).ok
    dataset = open_dataset(tmp_path / "shards")
    assert {split: len(members) for split, members in dataset.splits.items()} == {"test": 2, "train": 6, "val": 2}
    assert (task_of(dataset), dataset.classes) == ("vertex_segmentation", ("vessel", "aneurysm"))

    config = paper(task_of(dataset), width=16, epochs=4, warmup_epochs=0.0, batch_vertices=40, precision="fp32")
    history = train(dataset, config, tmp_path / "run", CPU)
    assert history[-1]["loss"] < 0.95 * history[0]["loss"]
    results, pictures = write_results(dataset, tmp_path / "run", history, CPU)
    assert {"val.png", "test.png"} <= {path.name for path in pictures}
    row = results["rows"]["test"]

    # new files are the test meshes: labels of their vertices, in the order of the file, are as right as it was said
    meshes = {name: raw / "annotated" / "obj" / f"{name}_full.obj" for name in ("AN1", "AN6")}
    (tmp_path / "scratch").mkdir()
    shards = features_of(meshes, LIGHT, tmp_path / "scratch", jobs=1)
    places = {source: (meshes[name], tmp_path / "out" / name) for source, name in source_names(meshes).items()}
    best = checkpoint.load(tmp_path / "run" / "best.safetensors")
    for rounds, figure in ((0, "accuracy"), (known_rounds(best, tmp_path / "run"), "voted_accuracy")):
        told = list(label_meshes(best, outputs_of(best, rounds, pictures=False), shards, places, CPU))
        assert [(mesh["labelled"], mesh["unlabelled"]) for mesh in told] == [("vertex", 1)] * 2
        right = []
        for name in meshes:
            truth = np.loadtxt(raw / "annotated" / "ad" / f"{name}-_norm.ad", usecols=6) > 0
            found = np.loadtxt(tmp_path / "out" / f"{name}.seg")
            assert found[-1] == -1
            right += (found == truth)[:-1].tolist()
        assert np.mean(right) == pytest.approx(row[figure])
