"""What `status` and `features --dry-run` say is what a run then does."""

import json
import re
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from faults import compute_or_fault
from shapes import FAMILY, bumpy, sphere, write_labels, write_obj

from meshshard.errors import UsageError
from meshshard.files import lock_folder
from meshshard.index import read_index
from meshshard.recipe import RECIPES
from meshshard_prep import status
from meshshard_prep.commands import status as verb
from meshshard_prep.datasets import read_dataset
from meshshard_prep.estimate import estimate
from meshshard_prep.isolation import Limits
from meshshard_prep.plan import make_plan
from meshshard_prep.run import run

PAPER = RECIPES["paper"]


@pytest.fixture
def raw(tmp_path):
    for number in range(8):
        vertices, faces = bumpy(number, 1)
        write_obj(tmp_path / "raw" / f"{number}.obj", vertices, faces)
        write_labels(tmp_path / "raw" / f"{number}.seg", [0] * len(faces))
    return tmp_path / "raw"


def go(raw, out, recipe=PAPER, **settings):
    return run(read_dataset(str(raw)), out, recipe, jobs=1, **settings)


def test_a_folder_of_shards_is_held_against_the_toml_file_of_its_name(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    write_obj(tmp_path / "bones" / "a.obj", *bumpy(0, 1))
    write_labels(tmp_path / "bones" / "gt" / "a.seg", [0] * 32)
    (tmp_path / "bones.toml").write_text('raw = "bones"\n[labels]\nfiles = "gt/{stem}.seg"\n')
    run(read_dataset("bones.toml"), tmp_path / "out", PAPER, jobs=1)
    verb("out", as_json=True)
    plan = json.loads(capsys.readouterr().out)["plan"]
    assert (plan["fresh"], plan["reasons"]) == (1, {})  # the folder alone would have no labels


def test_every_reason_is_told_and_computes_what_it_says(raw, tmp_path):
    out = tmp_path / "out"
    faulty = raw / "f-leave.obj"
    write_obj(faulty, *bumpy(20, 1))
    write_labels(raw / "f-leave.seg", [0] * 32)
    (raw / "7.obj").write_text("")
    go(raw, out, compute=compute_or_fault)
    write_obj(raw / "1.obj", *bumpy(30, 1))
    write_labels(raw / "2.seg", [1] * 32)
    write_obj(raw / "new.obj", *bumpy(31, 1))
    write_labels(raw / "new.seg", [0] * 32)
    (raw / "3.obj").unlink()
    (raw / "4.seg").unlink()
    plan = make_plan(read_dataset(str(raw)), out, PAPER)
    table = status.planned(read_dataset(str(raw)), out, PAPER)
    assert table["to_compute"] == {
        "0": "labels changed",  # there are two classes now, where there was one
        "1": "mesh changed",
        "2": "labels changed",
        "5": "labels changed",
        "6": "labels changed",
        "7": "not stored before: empty-file",
        "f-leave": "not stored before: crashed",
        "new": "new",
    }
    assert table["reasons"] == dict(Counter(table["to_compute"].values()))
    assert (plan.fresh, plan.gone, set(plan.rejected)) == (0, ("3",), {"4"})
    report = go(raw, out)
    assert (report.computed, len(report.index.ids)) == (7, 7)
    after = status.planned(read_dataset(str(raw)), out, PAPER)
    assert (after["fresh"], after["to_compute"], after["refused"]) == (7, {}, 2)


def test_versions_recipes_and_damage_are_reasons(raw, tmp_path, monkeypatch):
    out = tmp_path / "out"
    go(raw, out)
    other = replace(PAPER, name="short", times=(0.1,))
    assert set(make_plan(read_dataset(str(raw)), out, other).todo.values()) == {"another recipe"}
    with monkeypatch.context() as patch:
        patch.setattr("meshshard_prep.jobs.ALGORITHM_VERSION", 99)
        patch.setattr("meshshard_prep.before.ALGORITHM_VERSION", 99)
        reasons = set(make_plan(read_dataset(str(raw)), out, PAPER).todo.values())
        assert [re.sub(r"\d", "N", reason) for reason in reasons] == ["algorithm version N, now NN"]
    shard = out / read_index(out).shards[0].file
    shard.write_bytes(shard.read_bytes()[:-1])
    assert set(make_plan(read_dataset(str(raw)), out, PAPER).todo.values()) == {"its shard is damaged or gone"}


def test_what_is_staged_is_fresh_and_counted_as_waiting(raw, tmp_path):
    def interrupted(task, jobs):
        yield from map(task, jobs[:3])
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        go(raw, tmp_path / "out", engine=interrupted)
    table = status.planned(read_dataset(str(raw)), tmp_path / "out", PAPER)
    assert (table["fresh"], table["stale_or_missing"]) == (3, 5)
    with lock_folder(tmp_path / "out"):
        text = status.as_text(status.stored(tmp_path / "out") | {"plan": table}, "")
    assert "waiting   3" in text
    assert "a run is writing to it: process " in text
    assert "     5 to compute: new" in text


def test_estimates_are_near_what_is_stored(tmp_path):
    """Sizes a byte differ little between meshes of one kind; times are noisy, and only their order is held."""
    for number in range(30):
        write_obj(tmp_path / "raw" / f"{number}.obj", *bumpy(number, number % 3))
    plan = make_plan(read_dataset(str(tmp_path / "raw")), tmp_path / "out", PAPER)
    estimated = estimate(list(plan.jobs.values()), PAPER)
    report = go(tmp_path / "raw", tmp_path / "out")
    stored = sum(shard.bytes for shard in report.index.shards)
    assert estimated.trials == 5
    assert 0.6 < estimated.bytes / stored < 1.5
    assert 0.1 < estimated.seconds / report.mesh_seconds < 10
    assert estimate([], PAPER).seconds == 0


def test_a_name_that_a_toml_file_gave(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    write_obj(tmp_path / "raw" / "a.obj", *sphere(0))
    (tmp_path / "bones.toml").write_text('name = "bones"\nraw = "raw"\n')
    with pytest.raises(UsageError, match=r"no features of 'bones'.*compute them with: meshshard features bones"):
        verb("bones", as_json=True)
    go(tmp_path / "bones.toml", Path("data/features/bones/paper"))
    verb("bones", as_json=True)
    table = json.loads(capsys.readouterr().out)
    assert (table["stored"], table["plan"]["fresh"]) == (1, 1)


def test_an_estimate_survives_bad_meshes(tmp_path):
    for number, (vertices, faces) in enumerate(FAMILY.values()):
        write_obj(tmp_path / "raw" / f"{number}.obj", vertices, faces if number % 2 else np.array([[0, 0, 0]]))
    plan = make_plan(read_dataset(str(tmp_path / "raw")), tmp_path / "out", PAPER)
    assert 1 <= estimate(list(plan.jobs.values()), PAPER).trials < 5


def test_limits_are_those_of_the_call(tmp_path):
    raw = tmp_path / "raw"
    write_obj(raw / "a.obj", *sphere(5))
    report = go(raw, tmp_path / "out", limits=Limits(seconds=0.001))
    assert {entry.code for entry in report.index.failed} == {"time-limit"}
    assert go(raw, tmp_path / "out").ok
