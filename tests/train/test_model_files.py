"""Exported networks give what the network gives, on meshes that they were not exported with."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import onnx
import onnxruntime
import pytest
import torch
from samples import sample, write_dataset
from typer.testing import CliRunner

from meshshard import UsageError, open_dataset
from meshshard.cli import app
from meshshard_train import checkpoint, model, model_files
from meshshard_train.checkpoint import network_for
from meshshard_train.loading import Loading, Meshes
from meshshard_train.model_files import FORMATS, check_meshes, largest_difference, write_model
from meshshard_train.portable import OUTPUTS, Portable
from meshshard_train.predict import predictions
from meshshard_train.recipes import official, paper
from meshshard_train.state import State, to_checkpoint

CPU = torch.device("cpu")


def with_unused(number, level):
    """A mesh whose third vertex has no features, as one that no face uses."""
    found = sample(number, level=level)
    hks, normals, faces = found.hks.copy(), found.vertex_normals.copy(), found.faces.copy()
    hks[2], normals[2], faces[faces == 2] = 0, 0, 3
    return replace(
        found, hks=hks, vertex_normals=normals, faces=faces, mesh_label=1, vertex_labels=np.zeros(len(hks), "i2")
    )


@pytest.fixture(scope="module")
def dataset(tmp_path_factory):
    """Meshes of 6, 18 and 66 vertices."""
    return open_dataset(
        write_dataset(tmp_path_factory.mktemp("data"), [with_unused(n, n) for n in range(3)], [""] * 3)
    )


@pytest.fixture
def small(monkeypatch):
    """A network with a block in the first and in the last of four stages, to save time."""
    monkeypatch.setattr(model, "STAGES", (1, 0, 0, 1))


def trained(dataset, config):
    """A checkpoint whose weights, averages among them, are drawn so that every layer matters."""
    torch.manual_seed(0)
    network = network_for(config, len(dataset.recipe.times), len(dataset.classes))
    with torch.no_grad():
        for name, value in network.state_dict().items():
            if value.ndim == 1:
                value.add_(torch.rand(value.shape) * (1.0 if name.endswith("gamma") else 0.2))
    state = State(network=network, optimizer=torch.optim.SGD(network.parameters()))
    return to_checkpoint(state, dataset, config)


@pytest.mark.usefixtures("small")
@pytest.mark.parametrize(
    ("form", "config"),
    [
        (
            "onnx",
            paper(
                "segmentation", width=16, precision="fp32", scaling="log-area", normalisation="batch", backbone="mlp"
            ),
        ),
        ("onnx", official("classification", normalisation="grn", backbone="conv_residual")),
        ("onnx", paper("segmentation", width=16, precision="fp32", normalisation="instance_area")),
        ("torch", paper("vertex_segmentation", width=16, precision="fp32", normalisation="group", backbone="conv")),
    ],
    ids=lambda value: value if isinstance(value, str) else f"{value.task}-{value.normalisation}-{value.backbone}",
)
def test_a_file_predicts_what_the_network_predicts(dataset, form, config, tmp_path):
    best = trained(dataset, config)
    report = write_model(best, form, tmp_path / "new" / "file")
    assert report["largest_difference"] < 1e-5
    assert report["checked"] == [50, 333, 6, 66]
    file = (tmp_path / "new" / "file").read_bytes()
    assert str(Path(model_files.__file__).parent).encode() not in file  # nor where the code is, line by line
    run, portable = FORMATS[form][1](file), Portable(best)
    for number, _, expected in predictions(best.network(), Meshes(dataset, config, CPU, Loading()), range(3)):
        found = run(portable.fields_of(dataset[number])).detach().numpy()
        assert expected.std() > 1e-3
        np.testing.assert_allclose(found, expected, atol=2e-5)


@pytest.mark.usefixtures("small")
def test_coordinates_are_exported_as_they_are(dataset):
    config = paper("correspondence", width=16, precision="fp32", coordinates=7)
    best = trained(dataset, config)
    fields = Portable(best).fields_of(dataset[1])
    assert Portable(best)(**fields).shape == (18, 7)
    assert not torch.allclose(Portable(best)(**fields).sum(1), torch.ones(18))
    assert set(OUTPUTS) == {"segmentation", "vertex_segmentation", "classification", "correspondence"}


@pytest.mark.usefixtures("small")
def test_an_onnx_file_says_what_it_is(dataset, tmp_path):
    best = trained(dataset, paper("classification", width=16, precision="fp32", features=("dihedral",)))
    write_model(best, "onnx", tmp_path / "a.onnx")
    onnx.checker.check_model(onnx.load(tmp_path / "a.onnx"))
    session = onnxruntime.InferenceSession(tmp_path / "a.onnx", providers=["CPUExecutionProvider"])
    assert [(value.name, value.shape[1:]) for value in session.get_inputs()] == [("dihedral", []), ("hks", [16])]
    assert [value.name for value in session.get_outputs()] == ["probabilities"]
    about = session.get_modelmeta().custom_metadata_map
    assert json.loads(about["classes"]) == ["low", "middle", "high"]
    assert about["recipe"] == dataset.recipe.to_json()
    assert about["config"] == best.config.to_json()
    assert about["output"] == "probabilities of each class, one row for the mesh"


@pytest.mark.usefixtures("small")
def test_a_file_that_differs_is_refused_and_not_left(dataset, tmp_path, monkeypatch):
    best = trained(dataset, paper("segmentation", width=16, precision="fp32"))

    def another(portable, _):
        with torch.no_grad():
            portable.network.head[-1].bias[0] += 0.01
        return b"file"

    other = Portable(best)
    monkeypatch.setitem(FORMATS, "torch", (another, lambda _: lambda mesh: other(**mesh)))
    with pytest.raises(
        UsageError, match=r"they differ by up to 0\.00.*, and 0\.0001 is allowed; .*x was not written"
    ):
        write_model(best, "torch", tmp_path / "x")
    assert not list(tmp_path.iterdir())
    fields = check_meshes(best)[:1]
    assert largest_difference(other, lambda mesh: other(**mesh) * torch.nan, fields) == np.inf
    with pytest.raises(UsageError, match="--to is onnx or torch, not 'tf'"):
        write_model(best, "tf", tmp_path / "x")


@pytest.mark.usefixtures("small")
def test_without_the_data_set_random_meshes_are_enough(dataset):
    best = trained(dataset, paper("segmentation"))
    for state, classes in (({"folder": "gone"}, best.classes), (best.state, ("a", "b", "c"))):
        meshes = check_meshes(replace(best, state=state, classes=classes))
        assert [len(mesh["hks"]) for mesh in meshes] == [50, 333]
        assert all(not mesh["hks"][-1].any() and mesh["hks"][:-1].all() for mesh in meshes)


@pytest.mark.usefixtures("small")
def test_the_command_writes_and_tells(dataset, tmp_path, monkeypatch):
    best = trained(dataset, paper("segmentation", width=16, precision="fp32"))
    checkpoint.save(tmp_path / "best.safetensors", best)
    monkeypatch.setitem(FORMATS, "onnx", (lambda *_: b"file", lambda _: lambda mesh: Portable(best)(**mesh)))
    call = ["export-model", str(tmp_path), "--to", "onnx", "--out", str(tmp_path / "a.onnx")]
    done = CliRunner().invoke(app, call)
    assert (done.exit_code, (tmp_path / "a.onnx").read_bytes()) == (0, b"file")
    assert "a.onnx: 4 bytes" in done.output
    assert "takes vertices, vertex_normals, dihedral, hks, faces; gives probabilities of each class" in done.output
    report = json.loads(CliRunner().invoke(app, [*call, "--json"]).output)
    assert report["inputs"] == {
        "vertices": [3],
        "vertex_normals": [3],
        "dihedral": [],
        "hks": [16],
        "faces": [3],
    }
    assert (report["checked"], report["largest_difference"]) == ([50, 333, 6, 66], 0.0)
