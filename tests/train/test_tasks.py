"""Which task a data set is for, and what is learned of a mesh."""

from dataclasses import replace

import numpy as np
import pytest
from samples import sample, toy_dataset, write_dataset

from meshshard import UsageError, open_dataset
from meshshard_train.recipes import paper
from meshshard_train.tasks import check_task, labels_of, of_corners, task_of

ON_VERTICES = (np.arange(18) % 3).astype("i2")


def dataset_of(folder, *samples):
    return open_dataset(write_dataset(folder, samples, ["train"] * len(samples)))


@pytest.mark.parametrize(
    ("labels", "on_vertices", "task"),
    [
        ("faces", None, "segmentation"),
        (None, ON_VERTICES, "vertex_segmentation"),
        ("faces", ON_VERTICES, "segmentation"),
    ],
)
def test_faces_are_learned_where_they_are_labelled_and_else_vertices(tmp_path, labels, on_vertices, task):
    dataset = dataset_of(tmp_path, sample(1, labels=labels, vertex_labels=on_vertices))
    assert task_of(dataset) == task
    check_task(dataset, paper(task))
    other = {"segmentation": "vertex_segmentation", "vertex_segmentation": "segmentation"}[task]
    with pytest.raises(UsageError, match=f"is a data set for {task}, the run is for {other}"):
        check_task(dataset, paper(other))


def test_shards_of_different_kinds_are_refused_with_what_to_write(tmp_path, monkeypatch):
    toy_dataset(tmp_path)
    dataset = open_dataset(tmp_path)
    monkeypatch.delitem(dataset.shard(0).columns, "face_labels")
    with pytest.raises(UsageError, match=r'has shards without face_labels.*write to = "face" or to = "vertex"'):
        check_task(dataset, paper("segmentation"))


def test_vertices_without_features_are_not_learned():
    mesh = sample(1, labels=None, vertex_labels=ON_VERTICES)
    hks = mesh.hks.copy()
    hks[[0, 5]] = 0
    expected = [-1 if vertex in (0, 5) else vertex % 3 for vertex in range(18)]
    assert labels_of(replace(mesh, hks=hks), "vertex_segmentation").tolist() == expected
    assert labels_of(mesh, "segmentation").tolist() == [-1] * 32


def test_labels_of_vertices_are_drawn_at_the_corners_of_faces():
    mesh = sample(1, vertex_labels=ON_VERTICES)
    assert of_corners(ON_VERTICES, mesh, "vertex_segmentation")[4].tolist() == (mesh.faces[4] % 3).tolist()
    assert of_corners(mesh.face_labels, mesh, "segmentation") is mesh.face_labels
