import os
import re
import resource
import shutil
import socket
import subprocess
import sys
import time
from dataclasses import replace
from itertools import count
from pathlib import Path

import numpy as np
import pytest
from faults import Murderous
from shapes import FAMILY, bumpy, sphere, write_labels, write_obj

from meshshard import open_dataset
from meshshard.errors import UsageError
from meshshard.files import holder, lock_folder, publish
from meshshard.index import INDEX_NAME, read_index
from meshshard.recipe import RECIPES
from meshshard.verify import verify
from meshshard_prep import pack, staging
from meshshard_prep import run as run_module
from meshshard_prep.datasets import read_dataset
from meshshard_prep.datasets.layout import without_labels
from meshshard_prep.engines import on_this_machine
from meshshard_prep.run import run

PAPER = RECIPES["paper"]


@pytest.fixture
def raw(tmp_path):
    """A labelled folder: eight meshes to train with, two to test."""
    root = tmp_path / "raw"
    # not the tetrahedron: it has as many faces as vertices, and its labels could be either's
    family = {"small": sphere(1)} | {name: mesh for name, mesh in FAMILY.items() if name != "tetrahedron"}
    for number, (name, (vertices, faces)) in enumerate(family.items()):
        write_obj(root / "train" / f"{name}.obj", vertices, faces)
        write_labels(root / "train" / f"{name}.seg", (np.arange(len(faces)) + number) % 3)
    for seed in (5, 6):
        vertices, faces = bumpy(seed, 1)
        write_obj(root / "test" / f"bumpy{seed}.obj", vertices, faces)
        write_labels(root / "test" / f"bumpy{seed}.seg", np.arange(len(faces)) % 3)
    return root


def go(raw, out, jobs=1, recipe=PAPER, **settings):
    return run(read_dataset(str(raw)), out, recipe, jobs=jobs, **settings)


def tree(folder):
    """Name -> content of everything a run left, but its lock."""
    return {p.relative_to(folder): p.read_bytes() for p in folder.rglob("*") if p.is_file() and p.name != ".lock"}


def test_everything_is_stored(raw, tmp_path):
    report = go(raw, tmp_path / "out", val_fraction=0.25)
    assert (report.ok, report.computed) == (True, 10)
    dataset = open_dataset(tmp_path / "out")
    assert len(dataset) == 10
    assert {split: len(numbers) for split, numbers in dataset.splits.items()} == {"test": 2, "train": 6, "val": 2}
    assert list(dataset.ids) == sorted(dataset.ids)
    for number in range(len(dataset)):
        sample = dataset[number]
        labels = np.loadtxt(raw / f"{sample.id}.seg", dtype=int)
        np.testing.assert_array_equal(sample.face_labels, labels)
        assert sample.id == dataset.ids[number]
        assert sample.split == sample.id.split("/")[0]
    assert verify(tmp_path / "out", full=True) == []


def test_second_run_does_nothing(raw, tmp_path, monkeypatch):
    go(raw, tmp_path / "out")
    before = tree(tmp_path / "out")
    monkeypatch.setattr(pack, "publish", lambda *_: pytest.fail("written again"))
    report = go(raw, tmp_path / "out", engine=lambda *_: pytest.fail("computed again"))
    assert report.computed == 0
    assert tree(tmp_path / "out") == before


def test_same_bytes_for_one_and_two_workers_and_another_place(raw, tmp_path):
    go(raw, tmp_path / "one", jobs=1)
    moved = tmp_path / "moved" / "raw"
    moved.parent.mkdir()
    raw.rename(moved)
    go(moved, tmp_path / "two", jobs=2)
    assert tree(tmp_path / "one") == tree(tmp_path / "two")


def test_same_bytes_in_any_order(raw, tmp_path):
    go(raw, tmp_path / "whole")
    for seed in range(3):
        order = np.random.default_rng(seed).permutation(10)
        go(raw, tmp_path / f"{seed}", engine=lambda task, jobs, order=order: (task(jobs[i]) for i in order))
        assert tree(tmp_path / f"{seed}") == tree(tmp_path / "whole")


def test_interrupted_and_resumed(raw, tmp_path):
    """Interrupted after each number of meshes, a second run computes the rest and leaves the same bytes."""
    go(raw, tmp_path / "whole")
    for done in range(1, 10):
        out = tmp_path / f"killed{done}"

        def interrupted(task, jobs, done=done):
            yield from map(task, jobs[:done])
            raise KeyboardInterrupt

        with pytest.raises(KeyboardInterrupt):
            go(raw, out, engine=interrupted)
        assert not (out / INDEX_NAME).exists()
        assert go(raw, out).computed == 10 - done
        assert tree(out) == tree(tmp_path / "whole")


def test_killed_while_publishing_leaves_the_old_or_the_new(raw, tmp_path, monkeypatch):
    monkeypatch.setattr(pack, "MAX_MESHES", 3)
    go(raw, tmp_path / "old")
    write_labels(raw / "test" / "bumpy5.seg", [2] * 32)
    go(raw, tmp_path / "new")
    for call in range(1, 3):
        out = tmp_path / f"out{call}"
        shutil.copytree(tmp_path / "old", out)
        calls = count(1)

        def die(path, data, calls=calls, call=call):
            if next(calls) == call:
                raise OSError(28, "No space left on device")
            publish(path, data)

        with monkeypatch.context() as patch:
            patch.setattr(pack, "publish", die)
            with pytest.raises(OSError, match="No space"):
                go(raw, out)
        assert open_dataset(out)[0].face_labels[0] == 0  # the old data set, whole
        assert read_index(out) == read_index(tmp_path / "old")
        go(raw, out)
        assert tree(out) == tree(tmp_path / "new")


def test_one_changed_label_file_computes_one_sample(raw, tmp_path):
    go(raw, tmp_path / "out")
    write_labels(raw / "train" / "box.seg", [1] * 12)
    assert go(raw, tmp_path / "out").computed == 1
    dataset = open_dataset(tmp_path / "out")
    assert dataset[dataset.ids.index("train/box")].face_labels.tolist() == [1] * 12
    assert verify(tmp_path / "out", full=True) == []


def test_taking_a_mesh_away_and_another_split_seed_compute_nothing(raw, tmp_path):
    go(raw, tmp_path / "out")
    (raw / "train" / "box.obj").unlink()
    assert go(raw, tmp_path / "out").computed == 0
    assert "train/box" not in open_dataset(tmp_path / "out").ids
    shards = read_index(tmp_path / "out").shards
    assert go(raw, tmp_path / "out", split_seed=3).computed == 0
    assert read_index(tmp_path / "out").shards == shards


def test_another_recipe_has_its_own_samples(raw, tmp_path):
    go(raw, tmp_path / "out")
    report = go(raw, tmp_path / "out", recipe=replace(PAPER, name="short", times=(0.1, 0.2)))
    assert report.computed == 10
    assert open_dataset(tmp_path / "out")[0].hks.shape[1] == 2


@pytest.mark.parametrize("what", ["shard", "index", "cut", "gone"])
def test_a_damaged_folder_is_made_again(raw, tmp_path, what):
    out = tmp_path / "out"
    go(raw, out)
    before = tree(out)
    path = out / (INDEX_NAME if what == "index" else read_index(out).shards[0].file)
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    if what == "gone":
        path.unlink()
    else:
        path.write_bytes(data[:100] if what == "cut" else data)
    assert verify(out)
    # a damaged index costs nothing: shards say themselves what they hold
    assert go(raw, out).computed == (0 if what == "index" else 10)
    assert tree(out) == before


def test_a_damaged_staged_sample_is_computed_again(raw, tmp_path, monkeypatch):
    out = tmp_path / "out"
    with monkeypatch.context() as patch:
        patch.setattr(run_module, "publish_dataset", lambda *_, **__: (_ for _ in ()).throw(KeyboardInterrupt))
        with pytest.raises(KeyboardInterrupt):
            go(raw, out)
    first = next(iter(staging.staged(out).values()))
    first.write_bytes(first.read_bytes()[:-1] + b"?")
    assert go(raw, out).computed == 1
    assert verify(out, full=True) == []


HOSTILE = {
    "truncated.obj": ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2", "bad-face", "truncated.obj:4"),
    "empty.obj": ("", "empty-file", "empty.obj"),
    "pointer.obj": (
        "version https://git-lfs.github.com/spec/v1\noid sha256:12\nsize 3\n",
        "not-a-mesh",
        "pointer.obj",
    ),
    "nan.obj": ("v 0 0 0\nv 1 0 nan\nv 0 1 0\nf 1 2 3\n", "not-finite", "nan.obj:2"),
    "range.obj": ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", "index-out-of-range", "range.obj:4"),
}


def test_hostile_folder(tmp_path):
    """Six bad meshes cost six meshes; each refusal names rule, values, place and remedy."""
    root = tmp_path / "raw"
    for name in ("good1", "good2", "short"):
        write_obj(root / f"{name}.obj", *sphere(1))
        write_labels(root / f"{name}.seg", [0, 1] * 16)
    write_labels(root / "short.seg", [0, 1] * 15 + [0])
    for name, (content, _, _) in HOSTILE.items():
        (root / name).write_text(content)
        write_labels(root / name.replace(".obj", ".seg"), [0])
    report = go(root, tmp_path / "out", jobs=2)
    assert not report.ok
    assert list(report.index.ids) == ["good1", "good2"]
    refused = {entry.source: entry for entry in report.index.refused}
    assert set(refused) == {*HOSTILE, "short.obj"}
    assert not report.index.failed
    for name, (_, code, place) in HOSTILE.items():
        assert refused[name].code == code
        assert refused[name].message.startswith(place)
    assert "32 (faces) or 48 (edges) or 18 (vertices), but it has 31." in refused["short.obj"].message
    assert all(", but " in entry.message for entry in refused.values())
    # refusals are remembered, and forgotten when the file changes
    assert go(root, tmp_path / "out").computed == 0
    write_labels(root / "short.seg", [0, 1] * 16)
    assert list(go(root, tmp_path / "out").index.ids) == ["good1", "good2", "short"]


def test_missing_label_file_and_unreadable_mesh(tmp_path):
    for name in ("a", "b", "c"):
        write_obj(tmp_path / "raw" / f"{name}.obj", *sphere(1))
    write_labels(tmp_path / "raw" / "a.seg", [0] * 32)
    (tmp_path / "raw" / "c.obj").unlink()
    (tmp_path / "raw" / "c.obj").symlink_to(tmp_path / "nowhere")
    refused = {entry.id: entry for entry in go(tmp_path / "raw", tmp_path / "out").index.refused}
    assert (refused["b"].code, refused["c"].code) == ("no-labels", "unreadable")
    assert "label file is b.seg, but there is no such file. Put it at raw/b.seg" in refused["b"].message


def test_a_file_that_changes_during_the_run_is_tried_again(raw, tmp_path):
    def change(task, jobs):
        write_labels(raw / "train" / "box.seg", [2] * 12)
        yield from map(task, jobs)

    report = go(raw, tmp_path / "out", engine=change)
    assert [(entry.code, entry.message) for entry in report.index.failed] == [
        ("changed", "train/box.obj: the file changed while the run went on; run again [changed]")
    ]
    assert len(report.index.ids) == 9
    assert go(raw, tmp_path / "out").ok


def test_a_folder_that_workers_do_not_share_is_told(raw, tmp_path):
    def elsewhere(task, jobs):
        (tmp_path / "elsewhere" / staging.FOLDER).mkdir(parents=True)
        yield from map(replace(task, out=tmp_path / "elsewhere"), jobs)

    with pytest.raises(UsageError, match="--out must be a folder that all workers share"):
        go(raw, tmp_path / "out", engine=elsewhere)


def test_a_worker_killed_from_outside_loses_nothing(raw, tmp_path):
    def engine(task, jobs):
        return on_this_machine(Murderous(task, "train/box", tmp_path / "killed"), jobs, workers=2)

    assert go(raw, tmp_path / "out", engine=engine).ok
    assert (tmp_path / "killed").exists()
    assert verify(tmp_path / "out", full=True) == []


def test_a_mesh_that_kills_every_worker_is_found(raw, tmp_path):
    def engine(task, jobs):
        return on_this_machine(Murderous(task, "train/box"), jobs, workers=2)

    report = go(raw, tmp_path / "out", engine=engine)
    assert [(entry.id, entry.code) for entry in report.index.failed] == [("train/box", "lost")]
    assert len(report.index.ids) == 9
    assert go(raw, tmp_path / "out").ok


def test_nothing_to_store_leaves_the_reasons(tmp_path):
    (tmp_path / "raw").mkdir()
    (tmp_path / "raw" / "a.obj").write_text("v 0 0 0\n")
    go(tmp_path / "raw", tmp_path / "out")
    index = read_index(tmp_path / "out")
    assert (index.shards, index.ids) == ((), ())
    assert [(entry.id, entry.code) for entry in index.refused] == [("a", "no-faces")]
    assert len(open_dataset(tmp_path / "out")) == 0
    assert verify(tmp_path / "out", full=True) == []


def test_a_remembered_refusal_names_its_own_file(tmp_path):
    for name in ("a", "b"):
        (tmp_path / "raw").mkdir(exist_ok=True)
        (tmp_path / "raw" / f"{name}.obj").write_text("")
    for _ in range(2):
        messages = [entry.message for entry in go(tmp_path / "raw", tmp_path / "out").index.refused]
        assert [message[:6] for message in messages] == ["a.obj:", "b.obj:"]


def test_a_name_that_is_not_utf8_and_a_pipe_cost_one_mesh_each(tmp_path):
    write_obj(tmp_path / "raw" / "good.obj", *sphere(1))
    Path(os.fsdecode(os.fsencode(tmp_path / "raw") + b"/caf\xe9.obj")).write_text("v 0 0 0\n")
    os.mkfifo(tmp_path / "raw" / "pipe.obj")
    index = go(tmp_path / "raw", tmp_path / "out").index
    assert index.ids == ("good",)
    assert {entry.id: entry.code for entry in index.refused} == {"caf\\xe9": "bad-name", "pipe": "unreadable"}


def test_packing_and_reading_need_few_file_descriptors(tmp_path, monkeypatch):
    monkeypatch.setattr(pack, "MAX_MESHES", 10)
    for number in range(60):
        write_obj(tmp_path / "raw" / f"{number:02}.obj", *bumpy(number, 0))
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (len(list(Path("/proc/self/fd").iterdir())) + 24, hard))
    try:
        go(tmp_path / "raw", tmp_path / "out")
        dataset = open_dataset(tmp_path / "out")
        assert len([dataset[number] for number in range(60)]) == 60
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


def test_killed_outright(raw, tmp_path):
    """SIGKILL in mid-run: what was staged is not computed again, and the result is that of an unbroken run."""
    go(raw, tmp_path / "whole")
    words = [sys.executable, "-m", "meshshard", "features", str(raw), "--out", str(tmp_path / "out"), "--jobs", "1"]
    with subprocess.Popen(words, stdout=subprocess.DEVNULL) as process:
        while not list((tmp_path / "out").glob(".staging/[!.]*.sample")):
            assert process.poll() is None
            time.sleep(0.001)
        process.kill()
    done = len(staging.staged(tmp_path / "out"))
    assert 1 <= done < 10
    assert go(raw, tmp_path / "out").computed == 10 - done
    assert tree(tmp_path / "out") == tree(tmp_path / "whole")


def test_a_refused_mesh_does_not_move_the_others_between_splits(raw, tmp_path):
    before = go(raw, tmp_path / "out").index
    splits = dict(zip(before.ids, before.splits, strict=True))
    (raw / "train" / "box.obj").write_text("")
    after = go(raw, tmp_path / "out").index
    assert dict(zip(after.ids, after.splits, strict=True)) == {k: v for k, v in splits.items() if k != "train/box"}


def test_a_folder_is_not_made_into_another_data_set(raw, tmp_path):
    go(raw, tmp_path / "out")
    before = tree(tmp_path / "out")
    write_obj(tmp_path / "other" / "x.obj", *sphere(1))
    write_obj(tmp_path / "deep" / "raw" / "y.obj", *sphere(1))
    for folder, message in (
        (tmp_path / "other", "holds the data set 'raw' of 10 meshes, and this is 'other', with 0 of them"),
        (tmp_path / "deep" / "raw", "and this is 'raw', with 0 of them; give another --out"),
    ):
        with pytest.raises(UsageError, match=message):
            go(folder, tmp_path / "out")
    assert tree(tmp_path / "out") == before


def test_labels_that_are_stored_are_not_lost_to_a_run_without_them(raw, tmp_path):
    index = go(raw, tmp_path / "out").index
    assert index.task == "segmentation"
    bare = without_labels(read_dataset(str(raw)))
    with pytest.raises(UsageError, match=r"holds 'raw' for segmentation, and this would make it unlabelled;"):
        run(bare, tmp_path / "out", PAPER, jobs=1)
    assert read_index(tmp_path / "out") == index


def test_one_run_a_folder_and_the_second_is_told_who_holds_it(raw, tmp_path):
    assert holder(tmp_path / "out") == ""
    with lock_folder(tmp_path / "out"):
        who = rf"process {os.getpid()} on {socket.gethostname()} since \d{{4}}-\d\d-\d\d"
        with pytest.raises(UsageError, match=f"another run is writing to .*: {who}"):
            go(raw, tmp_path / "out")
        assert re.match(who, holder(tmp_path / "out"))
    assert holder(tmp_path / "out") == ""


def test_temporary_files_of_a_killed_run_are_removed(raw, tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / ".tmp-1-shard.h5").write_text("half")
    go(raw, tmp_path / "out")
    assert verify(tmp_path / "out") == []


def test_two_meshes_with_one_id_are_refused(raw, tmp_path):
    dataset = read_dataset(str(raw))
    twice = replace(dataset, entries=(*dataset.entries, dataset.entries[0]))
    with pytest.raises(UsageError, match="two meshes have the id"):
        run(twice, tmp_path / "out", PAPER)


def test_shards_are_cut_at_their_limits(raw, tmp_path, monkeypatch):
    monkeypatch.setattr(pack, "MAX_MESHES", 4)
    assert [shard.meshes for shard in go(raw, tmp_path / "a").index.shards] == [4, 4, 2]
    monkeypatch.setattr(pack, "MAX_VERTICES", 100)
    sizes = [shard.vertices for shard in go(raw, tmp_path / "b").index.shards]
    assert max(sizes) <= 100 or 1 in [shard.meshes for shard in read_index(tmp_path / "b").shards]
    assert len(open_dataset(tmp_path / "b")) == 10
