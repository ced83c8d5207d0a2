"""Several processes train as one does."""

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace

import pytest
import torch
from samples import sample, write_dataset
from training import CONFIG, CPU, rows, team_of, train_here, train_in_team

from meshshard import UsageError, open_dataset
from meshshard_train import team as teams
from meshshard_train.data import steps_of
from meshshard_train.recipes import paper
from meshshard_train.state import METRICS
from meshshard_train.team import Team

SPLITS = ["train"] * 8 + ["val"] * 3 + ["test"] * 3
SETTINGS = (
    "--set",
    "width=16",
    "--epochs",
    "2",
    "--batch-vertices",
    "80",
    "--precision",
    "fp32",
    "--device",
    "cpu",
    "--json",
)


@pytest.mark.parametrize("size", [1, 2, 3, 5])
def test_each_mesh_is_in_one_share(size):
    for meshes in range(9):
        shares = [Team(rank, size).share(range(meshes)) for rank in range(size)]
        assert sorted(number for share in shares for number in share) == list(range(meshes))
        assert max(map(len, shares)) - min(map(len, shares)) <= 1


def test_losses_are_those_of_one_process(tmp_path):
    """Shards of one, nine and four meshes; among the steps are some of one mesh, which the others have no part in."""
    data = write_dataset(tmp_path / "data", [sample(n, level=n % 3) for n in range(14)], SPLITS, cuts=(1, 10))
    size, config = 3, replace(CONFIG, batch_vertices=70)
    assert min(map(len, steps(data, config))) == 1
    members = team_of(size, train_in_team, tmp_path / "several", data, config.batch_vertices, 0.0)
    alone = train_here(data, tmp_path / "alone", config)
    for member in members:
        member.join()
    assert [member.exitcode for member in members] == [0] * size
    check_rows(tmp_path / "several", alone)


def check_rows(run, history):
    """The rows of a run are, within rounding, those of a history."""
    several = [json.loads(line) for line in (run / METRICS).read_text().splitlines()]
    for one, other in zip(rows(history), rows(several), strict=True):
        assert other == pytest.approx(one, abs=1e-5)


def steps(data, config):
    dataset = open_dataset(data)
    return [
        step
        for epoch in range(config.epochs)
        for step in steps_of(dataset.splits["train"], dataset.vertex_counts, config, epoch)
    ]


def fail_in_one(team, folder):
    """The last process has an error, and the others wait for it."""
    if team.rank == team.size - 1:
        raise UsageError("only here")
    team.gather(folder)


def test_an_error_in_one_process_is_told_by_it_alone(tmp_path):
    *waiting, failing = team_of(3, fail_in_one, tmp_path / "team")
    failing.join()
    assert failing.exitcode == 2
    time.sleep(0.5)
    assert [member.is_alive() for member in waiting] == [True, True]  # until torchrun ends them
    for member in waiting:
        member.terminate()
        member.join()
    assert [path.name for path in tmp_path.glob("*error*")] == ["team-error-2"]


def vanish(team, folder):
    """The last process dies, and the others notice."""
    if team.rank == team.size - 1:
        os.kill(os.getpid(), signal.SIGKILL)
    team.gather(folder)


def test_a_process_that_died_is_told_by_one_of_the_others(tmp_path):
    members = team_of(3, vanish, tmp_path / "team")
    while not any(member.exitcode == 2 for member in members):
        time.sleep(0.05)
    for member in members:
        member.terminate()
        member.join()
    (told,) = tmp_path.glob("*error*")
    assert "another process of this training has ended" in told.read_text()


def test_processes_that_start_differently_are_refused():
    class Two(Team):
        def gather(self, value):
            return [value, "epoch 1"]

    with pytest.raises(UsageError, match="do not start alike: epoch 0 and epoch 1; all machines need the same data"):
        Two(0, 2).check_same("epoch 0")


def test_running_averages_are_for_one_process():
    config = replace(CONFIG, normalisation="batch", vertex_fraction=1.0)
    Team().check(config)
    with pytest.raises(UsageError, match="normalisation = batch keeps averages"):
        Team(1, 2).check(config)


def test_more_processes_than_gpus_are_refused(monkeypatch):
    monkeypatch.setenv("LOCAL_WORLD_SIZE", "2")
    monkeypatch.setattr(torch.cuda, "device_count", lambda: 1)
    with pytest.raises(UsageError, match="2 processes, and 1 GPUs here: torchrun --nproc-per-node takes at most one"):
        teams.settle(torch.device("cuda"))


@pytest.mark.parametrize(("omp", "threads"), [("1", 4), ("3", None)])
def test_processes_share_the_cores_unless_told_otherwise(monkeypatch, omp, threads):
    taken = []
    monkeypatch.setattr(torch, "set_num_threads", taken.append)
    monkeypatch.setattr("os.cpu_count", lambda: 9)
    monkeypatch.setenv("LOCAL_WORLD_SIZE", "2")
    monkeypatch.setenv("OMP_NUM_THREADS", omp)
    teams.settle(CPU)
    assert taken == ([threads] if threads else [])


def torchrun(data, run, *more):
    """`meshshard train` by two processes."""
    command = [sys.executable, "-m", "torch.distributed.run", "--standalone", "--nproc-per-node", 2, "-m", "--"]
    command += ["meshshard", "train", data, "--run", run, *SETTINGS, *more]
    return subprocess.run(list(map(str, command)), capture_output=True, text=True, check=False)


def test_torchrun_gives_the_losses_of_one_process_and_results_once(tmp_path):
    data = write_dataset(tmp_path / "data", [sample(n, level=n % 3) for n in range(14)], SPLITS)
    done = torchrun(data, tmp_path / "run")
    assert done.returncode == 0, done.stderr
    results = json.loads(done.stdout)
    assert results == json.loads((tmp_path / "run" / "results.json").read_text())
    assert (results["epochs"], done.stderr.count("epoch 1  loss ")) == (2, 1)
    config = paper("segmentation", width=16, epochs=2, batch_vertices=80, precision="fp32")
    check_rows(tmp_path / "run", train_here(data, tmp_path / "alone", config))


def test_torchrun_tells_once_which_meshes_have_no_finite_loss(tmp_path):
    """After a first step that is far too long."""
    data = write_dataset(tmp_path / "data", [sample(n, level=n % 3) for n in range(14)], SPLITS)
    dataset, config = open_dataset(data), paper("segmentation", width=16, batch_vertices=80)
    members = steps_of(dataset.splits["train"], dataset.vertex_counts, config, 0)[1]
    assert len(members) > 1  # both processes have some
    done = torchrun(data, tmp_path / "run", "--learning-rate", "1e20")
    assert done.returncode != 0
    names = sorted(dataset.ids[number] for number in members)
    message = f"epoch 0: the loss is not finite on {names}; lower --learning-rate in another --run, or check"
    assert " ".join(done.stderr.split()).count(message) == 1
    assert done.stderr.count("error:") == 1
    assert not list((tmp_path / "run").glob("*.safetensors"))
