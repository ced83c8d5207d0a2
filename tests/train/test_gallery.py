"""`meshshard gallery`: rows of meshes as a picture."""

import json

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image
from samples import sample, toy_dataset, write_dataset

from meshshard import UsageError
from meshshard.palette import COLOURS, VIRIDIS
from meshshard_train import pictures
from meshshard_train.commands.gallery import gallery
from meshshard_train.gallery import spread


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


def test_meshes_are_evenly_spread():
    assert spread(range(10), 3) == [0, 4, 9]
    assert spread(range(2), 3) == [0, 1]
    assert spread([], 3) == []
