import importlib

import numpy as np
import pytest
import safetensors.torch
import torch
from quiet_pyg import import_pyg
from samples import sample, toy_dataset, write_dataset

from meshshard import UsageError, open_dataset
from meshshard_train.graphs import exporter, graph_of


@pytest.fixture(scope="module")
def pyg():
    """The module under test."""
    import_pyg()
    return importlib.import_module("meshshard_train.pyg")


def test_every_mesh_is_a_valid_data(pyg, tmp_path):
    shards = open_dataset(toy_dataset(tmp_path))
    graphs = pyg.ShardGraphs(tmp_path)
    assert (len(graphs), graphs.num_classes, graphs.num_node_features) == (14, 3, 20)
    for number, data in enumerate(graphs):
        expected = shards[number]
        assert data.validate()
        assert data.id == expected.id
        np.testing.assert_array_equal(data.pos, expected.vertices)
        np.testing.assert_array_equal(data.face, expected.faces.T)
        np.testing.assert_array_equal(data.y, expected.face_labels)
        np.testing.assert_array_equal(data.x[:, :16], expected.hks)
        np.testing.assert_array_equal(data.x[:, 16], expected.dihedral)
        np.testing.assert_array_equal(data.x[:, 17:], expected.vertex_normals)
        assert (data.face.dtype, data.y.dtype, data.x.dtype) == (torch.int64, torch.int64, torch.float32)
    assert graphs.columns[:2] == ("hks:0", "hks:1")
    assert graphs.columns[15:] == ("hks:15", "dihedral", *(f"vertex_normals:{axis}" for axis in range(3)))


def test_splits_are_those_of_the_index(pyg, tmp_path):
    shards = open_dataset(toy_dataset(tmp_path))
    for split, numbers in shards.splits.items():
        assert [data.id for data in pyg.ShardGraphs(tmp_path, split)] == [shards.ids[n] for n in numbers]
    assert [data.id for data in pyg.ShardGraphs(tmp_path, "val")[1:]] == ["mesh009", "mesh010"]
    with pytest.raises(UsageError, match="no split 'dev'"):
        pyg.ShardGraphs(tmp_path, "dev")


@pytest.mark.parametrize("workers", [0, 2])
def test_loader_of_pyg_joins_meshes(pyg, tmp_path, workers):
    """Corners of a batch point at the vertices of their own mesh."""
    from torch_geometric.loader import DataLoader

    toy_dataset(tmp_path)
    graphs = pyg.ShardGraphs(tmp_path, "train")
    start = 0
    for batch in DataLoader(graphs, batch_size=3, num_workers=workers):
        members = [graphs[start + number] for number in range(batch.num_graphs)]
        start += len(members)
        assert batch.id == [data.id for data in members]
        np.testing.assert_array_equal(batch.pos[batch.face], np.hstack([data.pos[data.face] for data in members]))
        np.testing.assert_array_equal(batch.y, np.concatenate([data.y for data in members]))
        np.testing.assert_array_equal(batch.batch[batch.face[0]], batch.batch[batch.face[2]])
    assert start == 8


def test_transforms_of_pyg_take_the_data(pyg, tmp_path):
    from torch_geometric.transforms import Compose, FaceToEdge, NormalizeScale

    toy_dataset(tmp_path)
    data = pyg.ShardGraphs(tmp_path, transform=Compose([NormalizeScale(), FaceToEdge()]))[0]
    assert data.edge_index.shape == (2, 2 * 12)  # an octahedron has 12 edges


def test_inputs_can_be_chosen(pyg, tmp_path):
    toy_dataset(tmp_path)
    graphs = pyg.ShardGraphs(tmp_path, inputs=("vertices", "dihedral"))
    assert graphs.columns == ("vertices:0", "vertices:1", "vertices:2", "dihedral")
    np.testing.assert_array_equal(graphs[0].x[:, :3], graphs[0].pos)
    for inputs, missing in ((("dihedral_signed",), "'dihedral_signed'"), (("hks", "id"), "'id'"), ((), "")):
        with pytest.raises(
            UsageError, match=rf"has no \[{missing}\]; inputs are one or more of vertices, vertex_normals, dihedral"
        ):
            pyg.ShardGraphs(tmp_path, inputs=inputs)


def test_labels_of_each_task():
    mesh = sample(0, level=0, labels=None)
    on_vertices = np.array([0, 1, -1, 0, 1, 2], dtype="i2")
    assert "y" not in graph_of(mesh, "unlabelled")
    assert graph_of(mesh, "segmentation")["y"].tolist() == [-1] * 8
    assert graph_of(mesh, "classification")["y"].tolist() == [-1]
    assert graph_of(sample(0, mesh_label=4), "classification")["y"].tolist() == [4]
    labelled = sample(0, level=0, labels=None, vertex_labels=on_vertices)
    assert graph_of(labelled, "segmentation")["y"].tolist() == on_vertices.tolist()


def test_exported_files_are_the_same_data(pyg, tmp_path):
    from torch_geometric.data import Data

    shards = write_dataset(tmp_path, [sample(number, mesh_label=number % 2) for number in range(3)], ["train"] * 3)
    graphs, encode = pyg.ShardGraphs(shards), exporter(open_dataset(shards)).encode
    for number, expected in enumerate(graphs):
        found = Data(**safetensors.torch.load(encode(graphs.shards[number])))
        assert set(found.keys()) == {"pos", "face", "x", "y"}
        for name in found.keys():  # noqa: SIM118  a Data is no dict
            assert torch.equal(found[name], expected[name])
