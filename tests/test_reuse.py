"""The Python blocks of docs/reuse.md, against a small data set and its exports."""

import re
from dataclasses import replace
from pathlib import Path

import pytest
from quiet_pyg import import_pyg
from samples import PAPER, write_dataset
from shapes import bumpy

from meshshard import open_dataset
from meshshard.export.formats import find_exporter
from meshshard.export.write import write_export
from meshshard_prep import compute_features
from meshshard_train import model
from meshshard_train.checkpoint import network_for
from meshshard_train.model_files import write_model
from meshshard_train.recipes import paper
from meshshard_train.state import started, to_checkpoint

PAGE = (Path(__file__).parents[1] / "docs" / "reuse.md").read_text()
BLOCKS = re.findall(r"```python\n(.*?)```", PAGE, flags=re.S)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A data set `shards` with labels and eigenpairs, and its exports, each in a folder of its format's name."""
    import_pyg()
    root = tmp_path_factory.mktemp("reuse")
    recipe = replace(PAPER, spectrum=4)
    samples = []
    for number, name in enumerate(("alien", "chair", "vase")):
        sample = compute_features(*bumpy(number, 1), recipe)
        labels = (sample.vertices[sample.faces].mean(axis=1)[:, 1] > 0).astype("i2")
        samples.append(replace(sample, id=name, source=f"{name}.obj", face_labels=labels))
    shards = write_dataset(root / "shards", samples, ["train"] * 3, classes=("below", "above"), recipe=recipe)
    dataset = open_dataset(shards)
    for form in ("npz", "pyg", "diffusionnet"):
        write_export(dataset, range(3), form, find_exporter(form, dataset), root / form)
    with pytest.MonkeyPatch.context() as patch:  # a network of a block a stage, to save time
        patch.setattr(model, "STAGES", (1, 1, 1, 1))
        config = paper("segmentation", width=16, precision="fp32")
        state = started(network_for(config, len(recipe.times), 2), config)
        write_model(to_checkpoint(state, dataset, config), "onnx", root / "network.onnx")
    return root


@pytest.mark.parametrize(
    ("block", "expected"),
    [
        (0, "alien (18, 3) (18, 16) (32, 3) 1\nchair (18, 3) (18, 16) (32, 3) 1\nvase (18, 3) (18, 16) (32, 3) 1\n"),
        (1, "Data(x=[18, 20], y=[32], pos=[18, 3], face=[3, 32], id='alien') 2 ('hks:0', "),
        (
            2,
            "['vertices', 'vertex_normals', 'dihedral', 'hks', 'faces'] (32, 2) probabilities of each class, a row",
        ),
        (3, "(18, 16) (32,) ['below' 'above']\nData("),
        (4, "True (18,)\n"),
    ],
)
def test_block(folder, monkeypatch, capsys, block, expected):
    monkeypatch.chdir(folder)
    exec(compile(BLOCKS[block], f"docs/reuse.md, block {block}", "exec"), {})
    assert capsys.readouterr().out.startswith(expected)


def test_there_is_no_other_block_and_the_first_is_short():
    assert len(BLOCKS) == 5
    assert len([line for line in BLOCKS[0].splitlines() if line]) <= 15


def test_the_first_block_knows_nothing_but_h5py():
    imported = re.findall(r"^(?:import|from) (\w+)", BLOCKS[0], flags=re.M)
    assert imported == ["json", "h5py"]


def test_every_format_is_in_the_table(folder):
    for form in ("npz", "ply", "vtkhdf", "pyg", "diffusionnet"):
        assert f"| `{form}` |" in PAGE
        assert find_exporter(form, open_dataset(folder / "shards")).encode(open_dataset(folder / "shards")[0])
