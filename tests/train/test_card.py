"""The model card says what is so: figures, hashes, settings, and limits that follow from them."""

import json
import re
from dataclasses import asdict, replace

import pytest
import torch
from samples import sample, toy_dataset, write_dataset

from meshshard import __version__, open_dataset
from meshshard.files import sha256_of_file
from meshshard_train import checkpoint, model
from meshshard_train.card import CARD, card_text
from meshshard_train.checkpoint import network_for
from meshshard_train.recipes import official, paper
from meshshard_train.results import write_results
from meshshard_train.state import BEST, started, to_checkpoint

CONFIG = paper("segmentation", precision="fp32", epochs=2)
RESULTS = {
    "epoch": 1,
    "epochs": 2,
    "seconds": 5400.0,
    "computed_in": ["fp32"],
    "compiled": False,
    "voting_rounds": 3,
    "classes_not_trained": ["high"],
    "rows": {"val": {"accuracy": 0.5}},
}


@pytest.fixture
def dataset(tmp_path):
    return open_dataset(toy_dataset(tmp_path / "data"))


@pytest.fixture(autouse=True)
def small(monkeypatch):
    """A network of a block a stage, to save time."""
    monkeypatch.setattr(model, "STAGES", (1, 1, 1, 1))


def trained(dataset, config):
    network = network_for(config, len(dataset.recipe.times), len(dataset.classes))
    return to_checkpoint(started(network, config), dataset, config)


def card(dataset, config, results=RESULTS):
    return card_text(trained(dataset, config), dataset, results, "abc", "a machine")


def rows(text):
    """First cell -> other cells of all tables."""
    lines = [re.split(r"(?<!\\)\|", line)[1:-1] for line in text.splitlines() if line.startswith("|")]
    return {cells[0].strip(): [cell.strip() for cell in cells[1:]] for cells in lines}


def test_a_finished_run_has_a_card_with_its_figures_and_hashes(dataset, tmp_path):
    run = tmp_path / "run"
    run.mkdir()
    checkpoint.save(run / BEST, trained(dataset, CONFIG))
    history = [{"epoch": 0, "loss": 1.0, "val_accuracy": 0.5, "seconds": 3600.0, "score": 0.5}]
    history[0] |= {"judged_by": "val_accuracy", "protocol": "x", "computed_in": "bf16", "compiled": True}
    results, _ = write_results(dataset, run, history, torch.device("cpu"))
    found = rows((run / CARD).read_text())
    stored = json.loads((run / "results.json").read_text())["rows"]
    assert list(stored) == ["val", "test"] == found["figure"]
    for name in ("accuracy", "mean_iou", "voted_accuracy"):
        assert found[name.replace("_", " ")] == [f"{stored[split][name]:.4f}" for split in stored]
    assert found[f"sha256 of {BEST}"] == [sha256_of_file(run / BEST)]
    assert found["hours"] == ["1.00"]
    assert found["computed in"] == ["bf16, compiled"]
    assert found["content_sha256"] == [dataset.index.content_sha256]
    assert found["splits_sha256"] == [dataset.index.splits_sha256]
    assert (found["torch"], found["meshshard"]) == ([torch.__version__], [__version__])
    assert CONFIG.protocol in (run / CARD).read_text().lower()
    assert results["rows"].keys() == stored.keys()


def test_every_setting_is_named_with_its_value(dataset):
    found = rows(card(dataset, replace(CONFIG, rotation_axes="", ema=0.999)))
    for name, value in asdict(CONFIG).items():
        if name not in ("features", "rotation_axes", "ema"):
            assert found[name] in ([str(value)], [", ".join(CONFIG.features)])
    assert (found["rotation_axes"], found["ema"]) == (["none"], ["0.999"])
    assert found["hours"] == ["1.50"]
    assert found["meshes trained on"] == ["8, of 6 to 66 vertices"]


def test_licence_citation_and_notes_are_the_data_sets_and_break_nothing(dataset):
    dataset.index = replace(
        dataset.index, licence="a | b\nc", citation="", notes=("<script>", "two"), dataset="x\n# y"
    )
    text = card(dataset, CONFIG)
    found = rows(text)
    assert found["licence"] == ["a \\| b\N{REPLACEMENT CHARACTER}c"]
    assert found["citation"] == ["not stated"]
    assert (found["note 1"], found["note 2"]) == (["&lt;script>"], ["two"])
    assert "\n# y" not in text


@pytest.mark.parametrize(
    ("changes", "said", "unsaid"),
    [
        ({}, "turned by quarter turns about y, and not otherwise", "share of"),
        ({"rotation_axes": ""}, "were not turned", "quarter turns"),
        ({"features": ("hks",)}, "do not depend on how a mesh is turned", "quarter turns"),
        ({"train_fraction": 0.5}, "a share of 0.5 of the training split", "no test split"),
        ({}, "centred and divided by its largest distance", "no test split"),
    ],
)
def test_limits_follow_from_the_settings(dataset, changes, said, unsaid):
    text = card(dataset, replace(CONFIG, **changes)).split("## Use and limits")[1]
    assert said in text
    assert unsaid not in text


def test_limits_follow_from_the_data(tmp_path):
    samples = [sample(number, mesh_label=number % 2, face_labels=None) for number in range(4)]
    folder = write_dataset(tmp_path / "a", samples, ["train", "train", "val", "val"], task="classification")
    text = card(open_dataset(folder), paper("classification"))
    assert "No training mesh has high: these classes were not learned." in text
    whole = card(open_dataset(folder), paper("classification"), RESULTS | {"classes_not_trained": []})
    assert "were not learned" not in whole
    assert "There is no test split: all figures are of meshes that chose the epoch." in text
    assert "Takes a triangle mesh and gives one class." in text


def test_the_published_protocol_is_named(dataset):
    text = card(dataset, official("segmentation", features=("vertices",)))
    assert "Published protocol: epoch chosen on TEST." in text
    assert "The test split chose the epoch" in text
    assert rows(text)["meshes trained on"] == ["11, of 6 to 66 vertices"]
