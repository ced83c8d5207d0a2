"""From a checkpoint and features to files, whoever writes them."""

from dataclasses import replace

import pytest
import torch
from samples import PAPER, sample, write_dataset

from meshshard import UsageError, open_dataset
from meshshard.files import sha256_of_file
from meshshard_train import labelling
from meshshard_train.checkpoint import Checkpoint, network_for
from meshshard_train.labelling import known_rounds, label_meshes, outputs_of
from meshshard_train.recipes import official, paper

CPU = torch.device("cpu")
CLASSES = ("low", "middle", "high")


def untrained(config):
    torch.manual_seed(0)
    network = network_for(config, len(PAPER.times), len(CLASSES))
    return Checkpoint(
        tensors={f"net.{name}": tensor for name, tensor in network.state_dict().items()},
        config=config,
        classes=CLASSES,
        recipe=PAPER,
        splits_sha256="",
        content_sha256="",
        state={"algorithm_version": 1, "colours": []},
    )


SEGMENTS = untrained(paper("segmentation", width=16, precision="fp32"))


def labelled(folder, samples, jobs=1, *, pictures=True, best=SEGMENTS, recipe=PAPER):
    """What is told of the meshes, and the files that are written, by their names."""
    dataset = open_dataset(write_dataset(folder / "shards", samples, [""] * len(samples), recipe=recipe))
    places = {s.source: (folder / s.source, folder / "out" / s.id) for s in samples}
    outputs = outputs_of(best, 1 if best is SEGMENTS else 0, pictures=pictures)
    told = list(label_meshes(best, outputs, dataset, places, CPU, jobs))
    return told, {path.name: path.read_bytes() for path in (folder / "out").iterdir()}


@pytest.mark.usefixtures("fine_pictures")  # processes of their own know of no others
def test_processes_write_what_one_writes(tmp_path, monkeypatch):
    monkeypatch.setattr(labelling, "MESHES_A_PROCESS", 1)
    samples = [sample(number, level=number % 2) for number in range(3)]
    (told, files), (others, same) = (labelled(tmp_path / str(jobs), samples, jobs) for jobs in (1, 2))
    assert [mesh["counts"] for mesh in told] == [mesh["counts"] for mesh in others]
    assert [mesh["source"][-11:] for mesh in others] == [s.source for s in samples]
    without_paths = {name: data for name, data in files.items() if not name.endswith(".json")}
    assert without_paths == {name: same[name] for name in without_paths}
    assert len(files) == len(same) == 15


@pytest.mark.parametrize("task", ["segmentation", "vertex_segmentation", "classification"])
def test_features_of_another_recipe_or_algorithm_are_refused_with_both(tmp_path, task):
    best = untrained(paper(task, width=16, precision="fp32"))
    other = replace(PAPER, weld=False)
    with pytest.raises(UsageError, match=r'"weld":false.*the network learned.*"weld":true'):
        labelled(tmp_path / "a", [sample(1, recipe=other)], best=best, recipe=other)
    newer = replace(best, state=best.state | {"algorithm_version": 2})
    with pytest.raises(UsageError, match=r"algorithm 1; the network learned .* algorithm 2: train anew"):
        labelled(tmp_path / "b", [sample(1)], best=newer)


def test_vertices_without_features_get_no_label(tmp_path):
    mesh = sample(1, labels=None)
    hks = mesh.hks.copy()
    hks[[0, 5]] = 0
    best = untrained(paper("vertex_segmentation", width=16, precision="fp32"))
    (told,), files = labelled(tmp_path, [replace(mesh, hks=hks)], best=best)
    lines = files["mesh001.seg"].split()
    assert [number for number, line in enumerate(lines) if line == b"-1"] == [0, 5]
    assert (len(lines), told["unlabelled"]) == (18, 2)


def test_what_cannot_be_labelled_or_cannot_vote_is_refused():
    with pytest.raises(UsageError, match="coordinates for correspondence, no classes"):
        outputs_of(replace(SEGMENTS, config=paper("correspondence")), 0, pictures=True)
    with pytest.raises(UsageError, match="--vote 3: neighbouring faces or vertices vote"):
        outputs_of(replace(SEGMENTS, config=paper("classification")), 3, pictures=True)


def test_rounds_of_voting_are_those_that_the_run_was_told_or_chose(tmp_path):
    assert known_rounds(SEGMENTS, tmp_path) is None
    (tmp_path / "best.safetensors").write_bytes(b"weights")
    digest = sha256_of_file(tmp_path / "best.safetensors")
    (tmp_path / "results.json").write_text(f'{{"voting_rounds": 8, "checkpoint_sha256": "{digest}"}}')
    assert known_rounds(SEGMENTS, tmp_path) == known_rounds(SEGMENTS, tmp_path / "best.safetensors") == 8
    (tmp_path / "best.safetensors").write_bytes(b"others")  # the results are not of these
    assert known_rounds(SEGMENTS, tmp_path) is None
    assert known_rounds(replace(SEGMENTS, config=official("segmentation")), tmp_path) == 3
