"""What a network says of meshes for a page."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from samples import PAPER, sample, write_dataset

from meshshard import UsageError, open_dataset
from meshshard_train.checkpoint import Checkpoint, network_for
from meshshard_train.judging import judge_of
from meshshard_train.recipes import paper

CPU = torch.device("cpu")
CLASSES = ("low", "middle", "high")


def untrained(task, **settings):
    torch.manual_seed(0)
    config = paper(task, width=16, precision="fp32", **settings)
    return Checkpoint(
        tensors={f"net.{k}": v for k, v in network_for(config, len(PAPER.times), 3).state_dict().items()},
        config=config,
        classes=CLASSES,
        recipe=PAPER,
        splits_sha256="",
        content_sha256="",
        state={"algorithm_version": 1, "colours": []},
    )


def test_a_network_that_diverged_is_refused(tmp_path):
    learned = untrained("segmentation", voting_rounds=0)
    broken = replace(learned, tensors={name: value * float("nan") for name, value in learned.tensors.items()})
    dataset = open_dataset(write_dataset(tmp_path, [sample(3)], ["test"]))
    with pytest.raises(UsageError, match="outputs for mesh003 are not finite: its training diverged; train anew"):
        list(judge_of(broken, tmp_path / "best.safetensors", dataset, CPU).opinions([0]))


def judged(folder, learned, samples, rounds=0, **settings):
    dataset = open_dataset(write_dataset(folder, samples, ["test"] * len(samples), **settings))
    judge = judge_of(
        untrained(learned, voting_rounds=rounds, batch_vertices=16), folder / "best.safetensors", dataset, CPU
    )
    return judge, list(judge.opinions(range(len(dataset))))


def test_the_score_is_the_share_of_labelled_faces_that_are_right_raw_and_voted(tmp_path):
    samples = [sample(n, level=2) for n in range(3)]
    samples[1] = replace(samples[1], face_labels=np.full_like(samples[1].face_labels, -1))
    raw, voted = (judged(tmp_path / str(rounds), "segmentation", samples, rounds) for rounds in (0, 3))
    assert (raw[0].element, raw[0].score, raw[0].classes) == ("faces", "accuracy", CLASSES)
    for mesh, opinion in zip(samples, raw[1], strict=True):
        assert opinion.labels.shape == mesh.face_labels.shape
    right = [float((o.labels == m.face_labels).mean()) for m, o in zip(samples, raw[1], strict=True)]
    assert [o.score for o in raw[1]] == pytest.approx([right[0], np.nan, right[2]], nan_ok=True)
    assert any((a.labels != b.labels).any() for a, b in zip(raw[1], voted[1], strict=True))


def test_one_mesh_may_be_asked_for_while_all_are_judged(tmp_path):
    samples = [sample(n, level=1) for n in range(8)]  # three in a batch
    judge, alone = judged(tmp_path, "segmentation", samples)
    found = []
    for opinion in judge.opinions(range(8)):
        (other,) = judge.opinions([7])
        assert other.score == alone[7].score
        found.append(opinion.score)
    assert found == [opinion.score for opinion in alone]


def test_vertices_and_whole_meshes(tmp_path):
    mesh = sample(1, level=1)
    labelled = replace(mesh, face_labels=None, vertex_labels=np.zeros(len(mesh.vertices), dtype="i2"))
    judge, (opinion,) = judged(tmp_path / "vertices", "vertex_segmentation", [labelled])
    assert (judge.element, len(opinion.labels)) == ("vertices", len(mesh.vertices))
    whole = replace(mesh, face_labels=None, mesh_label=2)
    judge, (opinion,) = judged(tmp_path / "whole", "classification", [whole], task="classification")
    assert (judge.element, judge.score, opinion.labels.shape) == ("mesh", "probability of its class", (1,))
    assert 0 < opinion.score < 1


def test_what_a_network_cannot_judge_is_refused(tmp_path):
    dataset = open_dataset(write_dataset(tmp_path, [sample(1)], ["test"], classes=("a", "b", "c")))
    with pytest.raises(UsageError, match=r"cannot be used on .*: classes: "):
        judge_of(untrained("segmentation"), Path("run"), dataset, CPU)
    with pytest.raises(UsageError, match="gives no classes to look at"):
        judge_of(untrained("correspondence"), Path("run"), dataset, CPU)


def test_a_mesh_without_labels_is_judged_and_has_no_score(tmp_path):
    plain = sample(1, labels="none")
    _, (opinion,) = judged(tmp_path, "segmentation", [plain], classes=(), task="unlabelled")
    assert np.isnan(opinion.score)
