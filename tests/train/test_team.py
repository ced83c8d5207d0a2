"""Several processes train as one does."""

import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from samples import sample, toy_dataset, write_dataset
from training import CONFIG, rows, run_in_child, team_of, train_and_die, train_here, train_in_team

from meshshard import UsageError, open_dataset
from meshshard_train.config import TrainConfig
from meshshard_train.state import METRICS
from meshshard_train.team import Team, settle


@pytest.mark.parametrize("size", [1, 2, 3, 5])
def test_each_mesh_is_in_one_share(size):
    for meshes in range(9):
        shares = [Team(rank, size).share(range(meshes)) for rank in range(size)]
        assert sorted(number for share in shares for number in share) == list(range(meshes))
        assert max(map(len, shares)) - min(map(len, shares)) <= 1


@pytest.mark.parametrize(("size", "batch_vertices", "keep_gib"), [(2, 100, 4.0), (3, 50, 0.0)])
def test_losses_are_those_of_one_process(tmp_path, size, batch_vertices, keep_gib):
    """Shards of one, nine and four meshes; steps of one mesh, which some processes have no part in."""
    splits = ["train"] * 8 + ["val"] * 3 + ["test"] * 3
    data = write_dataset(tmp_path / "data", [sample(n, level=n % 3) for n in range(14)], splits, cuts=(1, 10))
    members = team_of(size, train_in_team, str(tmp_path / "several"), data, batch_vertices, keep_gib)
    alone = train_here(data, tmp_path / "alone", TrainConfig.from_json(CONFIG.to_json()))
    for member in members:
        member.join()
    assert [member.exitcode for member in members] == [0] * size
    several = [json.loads(line) for line in (tmp_path / "several" / METRICS).read_text().splitlines()]
    assert [row["loss"] for row in several] == pytest.approx([row["loss"] for row in alone], abs=1e-5)
