"""`meshshard gallery`: rows of meshes as a picture."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
import torch
from matplotlib.figure import Figure
from PIL import Image
from samples import PAPER, sample, toy_dataset, write_dataset

from meshshard import UsageError
from meshshard.index import read_index
from meshshard.palette import COLOURS, VIRIDIS
from meshshard_train import pictures
from meshshard_train.checkpoint import Checkpoint, network_for, save
from meshshard_train.commands.gallery import gallery
from meshshard_train.gallery import _legend, _Row, spread
from meshshard_train.recipes import paper
from meshshard_train.state import BEST, publish_config


@pytest.fixture
def drawn(monkeypatch):
    """Figures that were saved."""
    found: list[Figure] = []
    save = pictures.save_figure
    monkeypatch.setattr(pictures, "save_figure", lambda figure, path: (found.append(figure), save(figure, path)))
    return found


@pytest.fixture(scope="module")
def shards(tmp_path_factory):
    return toy_dataset(tmp_path_factory.mktemp("gallery") / "shards")


def untrained(folder, shards, task, classes):
    """The folder of a run that has learned nothing."""
    config = paper(task, width=16, precision="fp32", voting_rounds=0)
    torch.manual_seed(0)
    tensors = {f"net.{k}": v for k, v in network_for(config, len(PAPER.times), len(classes)).state_dict().items()}
    names = {"classes": classes, "recipe": PAPER, "splits_sha256": "", "content_sha256": ""}
    state = {"folder": str(shards), "colours": [], "algorithm_version": 1, "trained": [], "judges": []}
    folder.mkdir()
    save(folder / BEST, Checkpoint(tensors=tensors, config=config, state=state, **names))
    publish_config(folder, config)
    return folder


def test_a_run_has_predictions_below_labels(shards, drawn, tmp_path):
    run = untrained(tmp_path / "run", shards, "segmentation", ("low", "middle", "high"))
    gallery(str(run), tmp_path / "a.png")
    assert titles(drawn[0])[:3] == ["mesh011", "mesh012", "mesh013"]
    assert all(re.fullmatch(r"predicted, [\d.]+ % right", title) for title in titles(drawn[0])[3:])
    assert drawn[0].get_suptitle() == "toy, test; epoch chosen on validation"
    gallery(str(run), tmp_path / "b.png", colour=["errors"], split="train", count=2)
    assert set(legend(drawn[1])) <= {"right", "wrong"}
    with pytest.raises(UsageError, match="has no split 'dev'"):
        gallery(str(run), tmp_path / "a.png", split="dev")


def test_a_run_whose_data_has_gone_asks_for_it(drawn, tmp_path):
    run = untrained(tmp_path / "run", tmp_path / "gone", "segmentation", ("low", "middle", "high"))
    with pytest.raises(UsageError, match="which is not there: name its shards with --data FOLDER"):
        gallery(str(run), tmp_path / "a.png")
    plain = [sample(n, level=1, labels="none") for n in range(2)]
    other = write_dataset(tmp_path / "plain", plain, ["train"] * 2, task="unlabelled", classes=())
    with pytest.raises(UsageError, match="has no split 'test'"):
        gallery(str(run), tmp_path / "a.png", data=str(other))
    gallery(str(run), tmp_path / "a.png", data=str(other), split="train")
    assert titles(drawn[0]) == ["mesh000", "mesh001", "predicted", "predicted"]
    assert "unlabelled" in legend(drawn[0])


def test_whole_meshes_are_named_by_their_class(drawn, tmp_path):
    samples = [sample(n, labels=None, mesh_label=n % 2) for n in range(2)]
    shards = write_dataset(tmp_path / "s", samples, ["test"] * 2, task="classification", classes=("odd", "even"))
    gallery(str(untrained(tmp_path / "run", shards, "classification", ("odd", "even"))), tmp_path / "a.png")
    assert titles(drawn[0])[:2] == ["mesh000", "mesh001"]
    assert set(titles(drawn[0])[2:]) <= {"odd", "even"}


def titles(figure):
    return [axes.get_title() for axes in figure.axes if axes.images]


def legend(figure):
    return [text.get_text() for box in figure.legends for text in box.get_texts()]


def pixels(path):
    with Image.open(path) as picture:
        return {tuple(pixel) for pixel in np.asarray(picture.convert("RGB")).reshape(-1, 3)}


def test_a_data_set_in_its_classes(shards, drawn, tmp_path, capsys):
    gallery(str(shards), tmp_path / "sub" / "a.png", split="test", columns=2)
    assert titles(drawn[0]) == ["mesh011", "mesh012", "mesh013"]
    assert legend(drawn[0]) == ["low", "middle", "high"]
    assert drawn[0].get_suptitle() == "toy, test"
    assert {tuple(bytes.fromhex(colour[1:])) for colour in COLOURS[:3]} <= pixels(tmp_path / "sub" / "a.png")
    assert capsys.readouterr().out.startswith(f"{tmp_path}/sub/a.png: 3 meshes, ")
    gallery(str(shards), tmp_path / "a.png", count=4, as_json=True)
    assert json.loads(capsys.readouterr().out)["meshes"] == ["mesh000", "mesh004", "mesh009", "mesh013"]


@pytest.mark.usefixtures("fine_pictures")
def test_heat_has_one_scale_for_all_meshes(shards, drawn, tmp_path):
    gallery(str(shards), tmp_path / "a.png", colour=["hks", "label"], columns=3, count=5)
    shown = ["mesh000", "mesh003", "mesh006"]
    assert titles(drawn[0]) == [*shown, *shown, "mesh010", "mesh013", "mesh010", "mesh013"]
    bars = [axes for axes in drawn[0].axes if axes.get_label() == "<colorbar>"]
    assert [axes.get_ylabel() for axes in bars] == ["HKS at t = 0.117 squared radii"]
    assert len(bars[0].get_yticklabels()) == 3
    assert tuple(bytes.fromhex(VIRIDIS[0][1:])) in pixels(tmp_path / "a.png")


def test_a_mesh_alone_has_its_colours_side_by_side(shards, drawn, tmp_path):
    gallery(str(shards), tmp_path / "a.png", id=["mesh003"], colour=["hks:0", "hks:15", "dihedral"])
    with Image.open(tmp_path / "a.png") as picture:
        assert picture.width > 2 * picture.height
    names = [axes.get_xlabel() for axes in drawn[0].axes if axes.get_label() == "<colorbar>"]
    assert names == [
        "HKS at t = 0.01 squared radii",
        "HKS at t = 1 squared radii",
        "dihedral angle, degrees, 90 and more",
    ]


def test_without_labels_heat_is_drawn_even_where_it_is_the_same_everywhere(drawn, tmp_path):
    flat = [sample(n, labels=None, hks=np.ones_like(sample(n).hks)) for n in range(2)]
    shards = write_dataset(tmp_path / "shards", flat, [""] * 2, task="unlabelled", classes=())
    gallery(str(shards), tmp_path / "a.png")
    assert legend(drawn[0]) == []
    with pytest.raises(UsageError, match="has no labels; try --colour hks"):
        gallery(str(shards), tmp_path / "b.png", colour=["label"])


def test_right_and_wrong_are_named_apart_from_classes():
    panels = {"panels": []}
    classes, verdicts = _Row(**panels, legend=[("#D55E00", "leg")]), _Row(**panels, legend=[("#D55E00", "wrong")])
    both = _legend({"label": classes, "prediction": classes, "errors": verdicts})
    assert both == [("#D55E00", "leg"), ("#D55E00", "errors: wrong")]
    assert _legend({"errors": verdicts, "hks": _Row(**panels)}) == [("#D55E00", "wrong")]


def test_what_cannot_be_drawn_is_refused(shards, tmp_path):
    for wrong, what in (
        ({"colour": ["prediction"]}, "--colour prediction is for the folder of a run"),
        ({"colour": ["errors"]}, "--colour errors is for the folder of a run"),
        ({"colour": ["hks:16"]}, "hks has the columns 0 to 15"),
        ({"colour": ["heat"]}, "--colour heat: meshes have label, "),
        ({"split": "dev"}, "has no split 'dev'"),
        ({"data": "other"}, "--data is for the folder of a run"),
    ):
        with pytest.raises(UsageError, match=what):
            gallery(str(shards), tmp_path / "a.png", **wrong)
    with pytest.raises(UsageError, match="--out is the PNG file"):
        gallery(str(shards), tmp_path / "a.pdf")
    assert not (tmp_path / "a.png").exists()


def test_an_empty_data_set_is_refused(tmp_path):
    folder = toy_dataset(tmp_path / "shards")
    replace(read_index(folder), shards=(), ids=(), keys=(), splits=()).write(folder)
    with pytest.raises(UsageError, match="holds no mesh"):
        gallery(str(folder), tmp_path / "a.png")


def test_meshes_are_evenly_spread():
    assert spread(range(10), 3) == [0, 4, 9]
    assert spread(range(2), 3) == [0, 1]
    assert spread([], 3) == []
