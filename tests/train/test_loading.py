"""However meshes get to the network, the numbers are the same, and the wait for them is known."""

import time
from dataclasses import replace

import pytest
from samples import sample, toy_dataset, write_dataset
from training import CONFIG, CPU, rows, train_here

from meshshard import UsageError, open_dataset
from meshshard.errors import InvalidShard
from meshshard_train import loading
from meshshard_train.loading import Loading, Meshes, Timed

ONE = replace(CONFIG, epochs=1)


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    """A data set, and the rows of a run that keeps it."""
    root = tmp_path_factory.mktemp("loading")
    data = toy_dataset(root / "data")
    return data, rows(train_here(data, root / "run", ONE))


@pytest.mark.filterwarnings("ignore:.*multi-threaded, use of fork:DeprecationWarning")
@pytest.mark.parametrize(("method", "workers"), [(None, 0), ("fork", 2), ("spawn", 1), ("forkserver", 1)])
def test_meshes_that_are_read_in_every_epoch_give_the_losses_of_kept_ones(kept, tmp_path, method, workers):
    how = Loading(keep_gib=0.0, workers=workers, start_method=method)
    assert rows(train_here(kept[0], tmp_path / "run", ONE, loading=how)) == kept[1]


@pytest.mark.filterwarnings("ignore:.*multi-threaded, use of fork:DeprecationWarning")
def test_workers_live_as_long_as_what_they_read(kept):
    meshes = Meshes(open_dataset(kept[0]), ONE, CPU, Loading(keep_gib=0.0, workers=1, start_method="fork"))
    first = [batch.numbers for batch in meshes.batches([[0, 1], [2]], 0)]
    process = meshes._loader._iterator._workers[0].pid
    assert first == [(0, 1), (2,)]
    assert [batch.numbers for batch in meshes.evaluation_batches([3, 4])] == [(3, 4)]
    assert meshes._loader._iterator._workers[0].pid == process


def test_what_is_kept_is_what_fits(kept):
    """Of 14 meshes: 26 bytes a face, 101 a vertex for 23 channels, a mask and labels; the limit is 0.5 MiB."""
    dataset = open_dataset(kept[0])
    size = sum(len(s.vertices) * (4 * 23 + 9) + len(s.faces) * 20 for s in map(dataset.__getitem__, range(14)))
    for limit, fits in ((size, True), (size - 1, False)):
        assert Meshes(dataset, ONE, CPU, Loading(keep_gib=limit / 2**30))._fits is fits


@pytest.mark.filterwarnings("ignore:.*multi-threaded, use of fork:DeprecationWarning")
@pytest.mark.parametrize("workers", [0, 1])
def test_a_damaged_shard_is_told_as_without_workers(tmp_path, workers):
    splits = ["train", "train", "val"]
    data = write_dataset(tmp_path, [sample(number) for number in range(3)], splits, cuts=(1,))
    (data / "shard-1.h5").write_bytes(b"x")
    meshes = Meshes(open_dataset(data), ONE, CPU, Loading(keep_gib=0.0, workers=workers, start_method="fork"))
    with pytest.raises(InvalidShard, match=r"shard-1.h5: the file is damaged: its sha256") as error:
        list(meshes.batches([[0], [1]], 0))
    assert "Traceback" not in str(error.value)


def test_no_such_start_method():
    with pytest.raises(UsageError, match="--start-method is fork, spawn, forkserver, not 'thread'"):
        Loading(start_method="thread")


def test_the_share_of_waiting_is_in_every_row(kept, tmp_path, monkeypatch):
    original, pause = loading.collate, 0.2

    def slow(*arguments):
        time.sleep(pause)
        return original(*arguments)

    monkeypatch.setattr(loading, "collate", slow)
    start = time.perf_counter()
    (row,) = train_here(kept[0], tmp_path / "run", ONE)
    whole = time.perf_counter() - start
    assert 2 * pause / whole < row["waited"] < 1


def test_only_the_wait_is_counted():
    timed = Timed(iter([1, 2, 3]), seconds=5.0)
    for _ in timed:
        time.sleep(0.05)
    assert 5 <= timed.seconds < 5.05
