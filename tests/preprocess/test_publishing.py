"""R5: whichever system call of publishing fails, a folder holds the old data set or the new one, never another."""

import contextlib
import shutil

import pytest
from disk_faults import KINDS, fault_at
from effort import SOAKING, times
from shapes import bumpy, write_obj

from meshshard import open_dataset
from meshshard.index import INDEX_NAME, read_index
from meshshard.recipe import RECIPES
from meshshard_prep import pack
from meshshard_prep.datasets import read_dataset
from meshshard_prep.isolation import Isolated, Limits
from meshshard_prep.lost import Lost
from meshshard_prep.run import run

PAPER = RECIPES["paper"]


def go(root, out, **settings):
    return run(read_dataset(str(root / "raw")), out, PAPER, jobs=1, **settings)


def pack_with_fault(root, out, position, kind):
    """The rest of an interrupted run, with a fault; the number of system calls it made."""
    pack.MAX_MESHES = 3
    with fault_at(position, kind) as made:
        go(root, out)
    return next(made) - 1


def contents(folder):
    """The samples that a reader sees, by name and digest."""
    dataset = open_dataset(folder)
    return [(sample.id, sample.digest) for sample in (dataset[number] for number in range(len(dataset)))]


def files(folder):
    return {path.name: path.read_bytes() for path in folder.glob("[!.]*")}


@pytest.fixture
def world(tmp_path, monkeypatch):
    """`old`: a data set of three shards. `ready`: the same, with all that a new version needs waiting to be packed.
    `new`: that version."""
    monkeypatch.setattr(pack, "MAX_MESHES", 3)
    for number in range(8):
        write_obj(tmp_path / "raw" / f"{number}.obj", *bumpy(number, 0))
    go(tmp_path, tmp_path / "old")
    write_obj(tmp_path / "raw" / "4.obj", *bumpy(20, 0))
    write_obj(tmp_path / "raw" / "8.obj", *bumpy(21, 0))
    (tmp_path / "raw" / "0.obj").unlink()
    shutil.copytree(tmp_path / "old", tmp_path / "ready")

    def interrupted(task, jobs):
        yield from map(task, jobs)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        go(tmp_path, tmp_path / "ready", engine=interrupted)
    for path in (tmp_path / "ready").glob("shard-*.h5"):
        if not (tmp_path / "old" / path.name).exists():
            path.unlink()  # shards are written while samples come in: here none is
    shutil.copytree(tmp_path / "ready", tmp_path / "new")
    assert go(tmp_path, tmp_path / "new").computed == 0
    return tmp_path


@pytest.mark.soak
@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind == "ENOSPC" or SOAKING])
def test_old_or_new_whatever_fails(world, kind, measured):
    old, new = contents(world / "old"), contents(world / "new")
    assert old != new
    process = Isolated()
    shutil.copytree(world / "ready", world / "counted")
    total = pack_with_fault(world, world / "counted", 0, kind)
    seen = []
    positions = range(1, total + 1, times(3, 1))
    for position in positions:
        out = world / f"out{position}"
        shutil.copytree(world / "ready", out)
        if kind == "exit":
            with pytest.raises(Lost, match="exit status 9"):
                process.call(pack_with_fault, world, out, position, kind, limits=Limits())
        else:
            with contextlib.suppress(OSError):
                pack_with_fault(world, out, position, kind)
        found = contents(out)
        assert found in (old, new), position
        seen.append(found == new)
        assert go(world, out).computed == 0  # nothing that was computed is lost
        assert files(out) == files(world / "new"), position
        shutil.rmtree(out)
    process.stop()
    if kind != "short":  # which only means something to writes
        assert seen == sorted(seen)  # one step from old to new
    assert set(seen) == {False, True}
    measured("R5", f"{kind} at {len(positions)} of {total} calls of publishing: the old data set or the new one")


def test_the_index_is_the_step(world):
    """What the index does not name does not exist: new shards beside an old index change nothing."""
    out = world / "ready"
    for path in (world / "new").glob("shard-*.h5"):
        shutil.copy(path, out)
    assert contents(out) == contents(world / "old")
    shutil.copy(world / "new" / INDEX_NAME, out)
    assert read_index(out) == read_index(world / "new")
    assert contents(out) == contents(world / "new")
