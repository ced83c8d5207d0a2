"""What `meshshard view` shows: a data set, a run, a mesh file."""

import pytest
import torch
from samples import PAPER, toy_dataset
from shapes import bumpy, write_obj

from meshshard import UsageError
from meshshard.view import serving
from meshshard_train.checkpoint import Checkpoint, network_for, save
from meshshard_train.commands.view import view
from meshshard_train.recipes import paper


@pytest.fixture
def shown(monkeypatch):
    """Takes down what would be served."""
    calls = []
    monkeypatch.setattr(serving, "serve", lambda *what: calls.append(what))
    monkeypatch.delenv("SSH_CONNECTION", raising=False)
    return calls


@pytest.fixture
def run(tmp_path):
    """A folder with a network that has learned nothing from a data set."""
    shards = toy_dataset(tmp_path / "shards")
    config = paper("segmentation", width=16, precision="fp32", voting_rounds=2)
    tensors = {f"net.{k}": v for k, v in network_for(config, len(PAPER.times), 3).state_dict().items()}
    state = {"folder": str(shards), "colours": ["#000000", "#FF0000", "#00FF00"], "algorithm_version": 1}
    names = {"classes": ("low", "middle", "high"), "recipe": PAPER, "splits_sha256": "", "content_sha256": ""}
    (tmp_path / "run").mkdir()
    torch.manual_seed(0)
    save(tmp_path / "run" / "best.safetensors", Checkpoint(tensors=tensors, config=config, state=state, **names))
    return tmp_path / "run"


def test_a_data_set(shown, tmp_path, monkeypatch):
    view(str(toy_dataset(tmp_path / "shards")), port=0)
    monkeypatch.setenv("SSH_CONNECTION", "1.2.3.4 5 6.7.8.9 22")
    view(str(tmp_path / "shards"), port=0)
    view(str(tmp_path / "shards"), port=0, open_page=True)
    dataset, judge, host, port, _ = shown[0]
    assert (len(dataset), judge, host, port) == (14, None, "127.0.0.1", 0)
    assert [call[-1] for call in shown] == [True, False, True]


def test_a_run_on_what_it_was_trained_on(shown, run):
    view(str(run), port=0)
    view(str(run / "best.safetensors"), port=0)
    for dataset, judge, *_ in shown:
        assert (len(dataset), judge.element, judge.colours[1]) == (14, "faces", "#FF0000")
        (opinion,) = judge.opinions([3])
        assert (len(opinion.labels), 0 <= opinion.score <= 1) == (len(dataset[3].faces), True)


def test_a_mesh_file_alone_and_as_a_run_labels_it(monkeypatch, run, tmp_path):
    mesh = tmp_path / "new.obj"
    write_obj(mesh, *bumpy(1, 1))
    seen = []
    monkeypatch.setattr(serving, "serve", lambda data, judge, *_: seen.append((data.ids, data.classes, judge)))
    view(str(mesh), port=0)
    view(str(run), data=str(mesh), port=0)
    assert [(ids, classes) for ids, classes, _ in seen] == [(("new",), ())] * 2
    assert seen[0][2] is None
    assert seen[1][2].classes == ("low", "middle", "high")


def test_other_data_is_for_runs(shown, tmp_path):
    with pytest.raises(UsageError, match="--data is for the folder of a run"):
        view(str(tmp_path), data="minicoseg", port=0)
    assert shown == []


@pytest.mark.parametrize("name", ["runs/chiars", "chair.obj"])
def test_what_is_not_there_is_told_as_what_it_might_have_been(shown, tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(UsageError, match=f"no features of '{name}': .* Nor is it a mesh file, or the folder"):
        view(name, port=0)
    assert shown == []
