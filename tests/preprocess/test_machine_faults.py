"""Faults of the machine are not taken for faults of meshes: the run ends, and what was published stays."""

import os
import resource
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from program import meshshard
from shapes import bumpy, write_obj

from meshshard import open_dataset
from meshshard.errors import UsageError
from meshshard.index import INDEX_NAME
from meshshard.recipe import RECIPES
from meshshard.verify import verify
from meshshard_prep import pack, staging, status
from meshshard_prep.datasets import read_dataset
from meshshard_prep.isolation import Isolated, Limits
from meshshard_prep.lost import Lost
from meshshard_prep.run import run

PAPER = RECIPES["paper"]


@pytest.fixture
def world(tmp_path, monkeypatch):
    """Six meshes, stored one a shard."""
    monkeypatch.setattr(pack, "MAX_MESHES", 1)
    for number in range(6):
        write_obj(tmp_path / "raw" / f"{number}.obj", *bumpy(number, 0))
    go(tmp_path)
    return tmp_path


def go(world, recipe=PAPER, **settings):
    return run(read_dataset(str(world / "raw")), world / "out", recipe, jobs=1, **settings)


def files(world):
    return {path.name: path.read_bytes() for path in (world / "out").glob("[!.]*")}


def test_a_stored_mesh_that_cannot_be_read_is_kept(world):
    before = files(world)
    (world / "raw" / "3.obj").unlink()
    os.mkfifo(world / "raw" / "3.obj")
    with pytest.raises(UsageError, match=r"1 meshes are stored whose raw files cannot be read now.*3\.obj"):
        go(world)
    assert files(world) == before
    (world / "raw" / "3.obj").unlink()
    report = go(world)
    assert (report.removed, len(report.index.ids)) == (("3",), 5)


def test_too_many_open_files_are_no_damage(world):
    before = files(world)
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (len(list(Path("/proc/self/fd").iterdir())) + 3, hard))
    try:
        with pytest.raises(UsageError, match="Too many open files; raise the limit: ulimit -n"):
            go(world)
        with pytest.raises(UsageError, match="raise the limit"):
            verify(world / "out", full=True)
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
    assert files(world) == before
    assert go(world).computed == 0


def test_a_full_disk_ends_the_run(world):
    before = files(world)

    def full(task, jobs):
        yield task(jobs[0])
        shutil.rmtree(world / "out" / staging.FOLDER)  # what is to be written there cannot be
        yield task(jobs[1])

    with pytest.raises(UsageError, match="cannot be written to: No such file"):
        go(world, replace(PAPER, name="short", times=(0.1,)), engine=full)
    assert files(world) == before


def broken_library(*_):
    raise ImportError("no such library")


def test_libraries_that_cannot_be_loaded_end_the_run():
    process = Isolated()
    process.warm_up = broken_library, ()
    for _ in range(2):  # the second call does not find a process that is cold
        with pytest.raises(UsageError, match="nothing can be computed here: ImportError: no such library"):
            process.call(len, "abc", limits=Limits())


def kill_once(flag):
    if not flag.exists():
        flag.touch()
        os.kill(os.getpid(), 9)


def test_a_kill_while_libraries_load_is_none_of_theirs(tmp_path):
    process = Isolated()
    process.warm_up = kill_once, (tmp_path / "flag",)
    with pytest.raises(Lost, match="SIGKILL"):
        process.call(len, "abc", limits=Limits())
    assert process.call(len, "abc", limits=Limits()) == 3


def linger():
    """Close the pipe, and go on."""
    os.closerange(3, 100)
    while True:
        pass


def test_a_process_that_closes_its_pipe_and_goes_on_is_ended():
    process = Isolated()
    with pytest.raises(Lost, match="SIGKILL"):
        process.call(linger, limits=Limits())


def test_a_signal_without_a_name_has_a_number():
    process = Isolated()
    with pytest.raises(Lost, match="signal 40"):
        process.call(os.kill, process.call(os.getpid, limits=Limits()), 40, limits=Limits())


@pytest.mark.parametrize("limits", [{"seconds": float("inf")}, {"seconds": -1.0}, {"memory": 10**18}])
def test_limits_that_are_none(limits):
    with pytest.raises(UsageError, match="limit is above 0 and at most"):
        Limits(**limits)


def test_a_damaged_index_keeps_the_owner_and_the_samples(world):
    path = world / "out" / INDEX_NAME
    path.write_bytes(path.read_bytes().replace(b"train", b"drain", 1)[:-3])
    write_obj(world / "other" / "x.obj", *bumpy(9, 0))
    other = read_dataset(str(world / "other"))
    with pytest.raises(UsageError, match="holds the data set 'of a damaged index' of 6 meshes"):
        run(other, world / "out", PAPER, jobs=1)
    with pytest.raises(UsageError, match="holds the data set"):
        status.planned(other, world / "out", PAPER)
    assert go(world).computed == 0
    assert len(open_dataset(world / "out")) == 6


def test_a_late_writer_does_not_fail_the_run(world, monkeypatch):
    original = Path.rmdir

    def late(folder):
        (folder / "late").write_text("")
        original(folder)

    monkeypatch.setattr(Path, "rmdir", late)
    write_obj(world / "raw" / "7.obj", *bumpy(7, 0))
    assert go(world).ok


def test_two_meshes_of_one_content_are_not_packed_anew(world, monkeypatch):
    shutil.copy(world / "raw" / "2.obj", world / "raw" / "9.obj")
    assert len(go(world).index.ids) == 7
    monkeypatch.setattr(pack, "_write", lambda *_: pytest.fail("packed again"))
    assert go(world).computed == 0


def test_paths_are_found_after_a_change_of_folder(world, monkeypatch):
    monkeypatch.chdir(world)
    dataset = read_dataset("raw")
    assert run(dataset, Path("there"), PAPER, jobs=1).ok
    (world / "deeper").mkdir()
    monkeypatch.chdir(world / "deeper")
    shutil.copytree(world / "raw", world / "deeper" / "raw")
    write_obj(world / "deeper" / "raw" / "8.obj", *bumpy(8, 0))
    assert run(read_dataset("raw"), Path("here"), PAPER, jobs=1).ok


def test_the_program_says_what_it_removed(world):
    (world / "raw" / "3.obj").unlink()
    status, out, error = meshshard("features", "raw", "--out", "out", cwd=world)
    assert status == 0, error
    assert "1 removed, for there is no raw file any more, as 3" in out


def test_raw_files_that_vanish_in_mid_run_do_not_empty_the_folder(world):
    before = files(world)
    for number in range(6):
        write_obj(world / "raw" / f"{number}.obj", *bumpy(50 + number, 0))

    def vanish(task, jobs):
        shutil.rmtree(world / "raw")
        yield from map(task, jobs)

    with pytest.raises(UsageError, match="1 meshes are stored whose raw files cannot be read now"):
        go(world, engine=vanish)
    assert files(world) == before


def test_a_name_as_long_as_the_system_allows_costs_nothing(world):
    write_obj(world / "raw" / ("x" * 251 + ".obj"), *bumpy(7, 0))
    assert len(go(world).index.ids) == 7


@pytest.mark.parametrize("make", [os.mkfifo, os.mkdir])
def test_a_lock_that_is_no_file_is_named(world, make):
    (world / "out" / ".lock").unlink()
    make(world / "out" / ".lock")
    for call in (lambda: go(world), lambda: status.stored(world / "out")):
        with pytest.raises(UsageError, match=r"\.lock is no regular file, and a run locks it; delete it"):
            call()


def test_a_limit_of_the_size_of_files_is_kept():
    words = [sys.executable, "-c", LIMITED]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    assert subprocess.run(words, env=environment, capture_output=True, text=True, check=True).stdout == "3\n"


LIMITED = """
import resource
resource.setrlimit(resource.RLIMIT_FSIZE, (10**6, 10**6))
from meshshard_prep.isolation import Isolated, Limits
print(Isolated().call(len, "abc", limits=Limits()))
"""
