"""Label files of predictions follow the rule of exported ones."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from plyfile import PlyData
from samples import PAPER, sample, write_dataset

from meshshard import open_dataset
from meshshard.label_lines import as_lines, line_labels
from meshshard.sample import DIAGNOSTICS
from meshshard_train.checkpoint import Checkpoint
from meshshard_train.inputs import input_size
from meshshard_train.model import TaskDrivenNet
from meshshard_train.prediction_files import write_predictions
from meshshard_train.recipes import paper


@pytest.mark.parametrize("simplify", [0, 8])
def test_lines_are_those_of_the_rule(tmp_path, simplify):
    recipe = replace(PAPER, steps=("weld",), simplify=simplify)
    source = np.arange(0, 64, 2, dtype="i4")  # every other face of the file was left out
    counts = dict.fromkeys(DIAGNOSTICS, 0) | {"dropped_faces": 32}
    vertex_source = np.arange(18, dtype="i4")
    mesh = sample(1, face_source=source, polygons=64, vertex_source=vertex_source, diagnostics=counts)
    dataset = open_dataset(write_dataset(tmp_path / "shards", [mesh], [""], recipe=recipe))
    config = paper("segmentation", precision="fp32")
    network = TaskDrivenNet(input_size(config, len(recipe.times)), 3)
    best = Checkpoint(
        tensors={f"net.{name}": tensor for name, tensor in network.state_dict().items()},
        config=config,
        classes=("low", "middle", "high"),
        recipe=recipe,
        splits_sha256="",
        content_sha256="",
        state={"algorithm_version": 1},
    )
    (line,) = write_predictions(best, dataset, tmp_path / "out", torch.device("cpu"))
    assert ("each line is of a face of the simplified mesh" in line) == bool(simplify)
    labels = np.array(PlyData.read(tmp_path / "out" / "mesh001.ply")["face"]["label"])
    written = (tmp_path / "out" / "mesh001.seg").read_bytes()
    assert written == as_lines(line_labels(mesh, labels, recipe))
    assert written.count(b"\n") == (32 if simplify else 64)
