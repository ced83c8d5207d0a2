import json

import numpy as np
import pytest

from meshshard_train import data, model
from meshshard_train.bench import measure, peer, report, shapes
from meshshard_train.bench.peer import Peer, vote_across_edges, vote_around_vertices

MESHES = 4


@pytest.fixture(scope="module")
def balls(tmp_path_factory):
    folder = tmp_path_factory.mktemp("balls")
    return folder, shapes.write_shards(folder, MESHES)


def test_ball_is_a_closed_surface_wound_outward():
    for seed in range(3):
        vertices, faces = shapes.ball(seed)
        assert (len(vertices), len(faces)) == (752, 1500)
        edges = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
        assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
        corners = vertices[faces]
        assert (np.linalg.det(corners) > 0).all()  # six times a volume: the centre is inside
    assert not np.array_equal(shapes.ball(0)[1], shapes.ball(1)[1])


@pytest.mark.parametrize(("vote", "shared"), [(vote_across_edges, 2), (vote_around_vertices, 1)])
def test_the_peer_counts_the_other_faces_that_share_enough_corners(tmp_path, vote, shared):
    mesh = shapes.sample(1)
    labels = np.random.default_rng(0).integers(len(shapes.CLASSES), size=len(mesh.faces))
    common = (mesh.faces[:, None, :, None] == mesh.faces[None, :, None, :]).any(axis=3).sum(axis=2)
    near = (common >= shared) & (common < 3)
    expected = (near @ np.eye(len(shapes.CLASSES), dtype=int)[labels]).argmax(axis=1)
    np.testing.assert_array_equal(vote(shapes.write_obj(tmp_path, mesh), labels), expected)


def test_the_peer_reads_the_mesh_files_again_only_to_vote(tmp_path):
    peer = Peer([shapes.sample(0)], tmp_path)
    before = [parameter.clone() for parameter in peer.network.parameters()]
    peer.paths[0].unlink()
    peer.train(voting=False)
    assert peer.done == 3
    assert any(not old.equal(new) for old, new in zip(before, peer.network.parameters(), strict=True))
    with pytest.raises(FileNotFoundError):
        peer.train(voting=True)


@pytest.fixture
def shallow(monkeypatch):
    """Networks of two of four stages with a block each, to save time."""
    monkeypatch.setattr(model, "STAGES", (1, 0, 0, 1))
    for module in (model, data, peer):
        monkeypatch.setattr(module, "BLOCKS", 4)


@pytest.mark.usefixtures("shallow")
def test_every_figure_is_measured_and_on_the_page(balls, tmp_path):
    folder, dataset = balls
    figures = {
        "versions": {"torch": "2"},
        "machine": {
            "processor": "abacus",
            "cores": 2,
            "load": 1.5,
            "threads": 1,
            "rounds": 1,
            "precision": "bf16",
        },
        "training": measure.training(dataset, folder, rounds=1, packed=(2,)),
        "voting": measure.voting(folder, rounds=1),
        "waiting": measure.waiting(dataset, steps=1),
        "starting": measure.starting(rounds=1),
        "gpu": None,
    }
    ours, published, without = figures["training"]
    assert (ours["meshes"], published["meshes"], published["ratio"], without["ratio_without_voting"]) == (2, 3, 1, 1)
    assert ours["ratio"] == pytest.approx(published["ms"] / ours["ms"])
    assert set(figures["waiting"]) == set(measure.LOADINGS)
    assert all(0 < share < 1 for share in figures["waiting"].values())
    report.write(tmp_path, figures)
    page = (tmp_path / "training.md").read_text()
    assert "Processor: abacus, 2 cores" in page
    assert f"| ours | 2 | {ours['ms']:.0f} | {ours['least_ms']:.0f} | {ours['ratio']:.2f} |" in page
    assert f"labels wrong: {figures['voting']['ours_ms']:.2f} ms" in page
    assert "GPU" not in page
    assert json.loads((tmp_path / "training.json").read_text())["waiting"] == pytest.approx(figures["waiting"])
    row = {"way": "as it is", "meshes": 20, "epoch_s": 0.7, "share": 0.123}
    page = report.page(figures | {"gpu": {"card": "loom", "peak_tflops": 700.0, "rows": [row]}})
    assert "loom: 700 TFLOPS" in page
    assert "| as it is | 20 | 0.70 | 12.3 % |" in page
