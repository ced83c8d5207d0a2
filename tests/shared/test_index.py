import json
import os
import re
from dataclasses import replace

import numpy as np
import pytest
from damage import damaged
from effort import times
from samples import sample, toy_dataset, write_dataset

from meshshard import open_dataset
from meshshard.errors import InvalidShard, UsageError
from meshshard.files import publish
from meshshard.index import Rejection, read_index, sealed
from meshshard.verify import verify


def test_round_trip(tmp_path):
    index = read_index(toy_dataset(tmp_path))
    richer = replace(index, refused=(Rejection(id="x", source="x.obj", code="no-faces", message="é", key="k"),))
    richer.write(tmp_path)
    assert read_index(tmp_path) == richer


def test_split_hash_depends_on_who_is_where_and_on_nothing_else(tmp_path):
    index = read_index(toy_dataset(tmp_path))
    same = replace(index, ids=index.ids[::-1], splits=index.splits[::-1], dataset="other")
    assert same.splits_sha256 == index.splits_sha256
    assert replace(index, splits=("val", *index.splits[1:])).splits_sha256 != index.splits_sha256


@pytest.mark.soak
def test_no_damage_is_silent(tmp_path, measured):
    """Of a shard or the index: neither to `verify`, nor to who reads samples."""
    folder = toy_dataset(tmp_path)
    files = [folder / "shard-0.h5", folder / "index.json"]
    count = times(200, 7000)
    for seed in range(count):
        path = files[seed // 3 % 2]
        whole = path.read_bytes()
        path.write_bytes(damaged(whole, seed))
        assert verify(folder), seed
        with pytest.raises(InvalidShard):
            open_dataset(folder)[seed % 14]
        path.write_bytes(whole)
    assert verify(folder) == []
    measured("R6", f"{count} damages of shard and index, none silent to verify, none to the streaming reader")


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", "not the index of a meshshard folder"),
        ("[]", "not the index of a meshshard folder"),
        ("{}", "not the index of a meshshard folder"),
        ('{"a": 1,\n"sha256": "0"\n}\n', "the index is damaged"),
        (sealed(b'{"format": "other"').decode(), "format 'other' version None"),
        (sealed(b"[" * 100_000).decode(), "the index is not JSON: maximum recursion depth"),
        (sealed(b'{"a": 1' + b"0" * 5000).decode(), "the index is not JSON: Exceeds the limit"),
    ],
)
def test_other_files_are_refused(tmp_path, content, message):
    (tmp_path / "index.json").write_text(content)
    with pytest.raises(InvalidShard, match=message):
        read_index(tmp_path)


def resealed(folder, **changes):
    """An index with other values and a seal that fits; None takes a part away."""
    table = json.loads((folder / "index.json").read_text()) | changes
    del table["sha256"]
    body = json.dumps({name: value for name, value in table.items() if value is not None})[:-1]
    (folder / "index.json").write_bytes(sealed(body.encode()))
    return folder


SHARD = {"file": "shard-0.h5", "bytes": 1, "sha256": "0" * 64, "vertex_counts": [18], "faces": 32}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"shards": None}, "a part of the index is missing or of another kind: 'shards'"),
        ({"shards": {}}, "'shards' is no list of dict"),
        ({"shards": [7]}, "'shards' is no list of dict"),
        ({"shards": [{"file": "a.h5"}]}, "['file'] is not ['bytes', 'faces', 'file'"),
        ({"shards": [SHARD | {"more": 1}]}, "'more', 'sha256', 'vertex_counts'] is not"),
        ({"shards": [SHARD | {"bytes": "1"}]}, "'bytes' is '1'"),
        ({"shards": [SHARD | {"file": None}]}, "'file' is None"),
        ({"shards": [SHARD | {"vertex_counts": [1.5]}]}, "'vertex_counts' is no list of int"),
        ({"shards": [SHARD | {"vertex_counts": [True]}]}, "'vertex_counts' is no list of int"),
        ({"shards": [SHARD | {"vertex_counts": [-1]}]}, "shard-0.h5 has a mesh with less than no vertex"),
        *(
            ({"shards": [SHARD | {"file": name}]}, "must lie in the folder of the index")
            for name in ("../../etc/passwd", "/etc/passwd", "../other/shard-0.h5", "a/b.h5", ".h5", "", "a\0.h5")
        ),
        ({"ids": ["a"] * 14}, "two samples of the index have the same id"),
        ({"ids": list(range(14))}, "'ids' is no list of str"),
        ({"ids": ["a"]}, "the index names 1 samples, with 14 keys and 14 splits, and its shards hold 14"),
        ({"keys": []}, "with 0 keys"),
        ({"splits": "train"}, "'splits' is no list of str"),
        ({"classes": [["a"]]}, "'classes' is no list of str"),
        ({"val_fraction": "1"}, "'val_fraction' is '1'"),
        ({"val_fraction": float("nan")}, "val_fraction is at least 0 and below 1, not nan"),
        ({"split_seed": 1.5}, "'split_seed' is 1.5"),
        ({"task": 3}, "'task' is 3"),
        ({"task": "x"}, "the task is one of segmentation, classification, correspondence, unlabelled, not 'x'"),
        ({"recipe": []}, "a recipe is a table of settings, not list"),
        ({"recipe": {"name": "x", "times": [10**400]}}, "int too large to convert to float"),
        ({"refused": [{"id": "x"}]}, "['id'] is not ['code', 'id'"),
        ({"format_version": 2}, "version 2; this meshshard reads 'meshshard-index' version 1"),
    ],
)
def test_a_sealed_index_of_nonsense_is_refused_by_name(tmp_path, changes, message):
    with pytest.raises(InvalidShard, match=re.escape(message)):
        read_index(resealed(toy_dataset(tmp_path), **changes))


def test_a_huge_index_is_not_read(tmp_path):
    with (tmp_path / "index.json").open("wb") as file:
        file.truncate(2**40)
    with pytest.raises(InvalidShard, match="1099511627776 bytes; an index has at most"):
        read_index(tmp_path)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"ids": [f"x{n:02}" for n in range(14)]}, "its ids are .* the index says .*x00"),
        ({"keys": [f"{n}" for n in range(14)]}, "its keys are .* the index says"),
        ({"classes": ["a", "b", "c"]}, "its classes are .*low.* the index says"),
        ({"recipe": {"name": "other"}}, "its recipe are .*paper.* the index says .*other"),
    ],
)
def test_an_index_of_other_samples_than_its_shard_is_noticed_on_first_touch(tmp_path, changes, message):
    dataset = open_dataset(resealed(toy_dataset(tmp_path), **changes))
    with pytest.raises(InvalidShard, match=message):
        dataset[3]
    assert verify(tmp_path) == []
    assert re.search(message, verify(tmp_path, full=True)[0])


@pytest.mark.parametrize(
    ("part", "change"), [("vertex_counts", [1] * 14), ("vertex_counts", [18] * 14), ("faces", 5)]
)
def test_an_index_of_other_sizes_than_its_shard_is_noticed_on_first_touch(tmp_path, part, change):
    (entry,) = json.loads((toy_dataset(tmp_path) / "index.json").read_text())["shards"]
    dataset = open_dataset(resealed(tmp_path, shards=[entry | {part: change}]))
    with pytest.raises(InvalidShard, match=f"its {part.replace('_', ' ')} are .* the index says"):
        dataset[0]


def test_no_index_says_what_to_type(tmp_path):
    with pytest.raises(UsageError, match="meshshard features DATASET --out"):
        open_dataset(tmp_path)
    os.mkfifo(tmp_path / "index.json")
    with pytest.raises(UsageError, match="cannot be read: it is no regular file"):
        read_index(tmp_path)
    (tmp_path / "index.json").unlink()
    (tmp_path / "index.json").mkdir()
    with pytest.raises(UsageError, match="cannot be read"):
        read_index(tmp_path)


def test_dataset_is_a_sequence(tmp_path):
    dataset = open_dataset(toy_dataset(tmp_path))
    assert len(dataset) == 14
    assert dataset.splits == {"test": (11, 12, 13), "train": tuple(range(8)), "val": (8, 9, 10)}
    assert (dataset.classes, dataset.task, dataset.name) == (("low", "middle", "high"), "segmentation", "toy")
    assert [dataset[n].id for n in range(14)] == list(dataset.ids)
    assert dataset.vertex_counts == [len(dataset[n].vertices) for n in range(14)]
    with pytest.raises(IndexError, match="number 14"):
        dataset[14]


def test_verify_finds_each_kind_of_damage(tmp_path):
    folder = toy_dataset(tmp_path)
    assert verify(folder) == verify(folder, full=True) == []
    shard = folder / "shard-0.h5"
    whole = shard.read_bytes()
    (folder / "shard-1.h5").write_bytes(b"")
    assert "no part of the data set" in verify(folder)[0]
    (folder / "shard-1.h5").unlink()
    shard.write_bytes(whole[:-1])
    assert "bytes, the index says" in verify(folder)[0]
    shard.write_bytes(whole[:-1] + bytes([whole[-1] ^ 1]))
    assert "its sha256 is" in verify(folder)[0]
    shard.unlink()
    assert "it is not there" in verify(folder)[0]
    (folder / "index.json").write_text("{}")
    assert "not the index" in verify(folder)[0]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"faces": np.full((32, 3), 99, dtype="i4")}, "'faces' has an index outside its mesh"),
        ({"dihedral": np.full(18, np.nan, dtype="f4")}, "dihedral is not finite"),
        ({"face_labels": np.full(32, 3, dtype="i2")}, "'face_labels' has a label outside -1..2"),
        ({"mesh_label": 7}, "'mesh_label' has a label outside -1..2"),
    ],
)
def test_full_verification_looks_into_the_arrays(tmp_path, change, message):
    folder = write_dataset(tmp_path, [replace(sample(0), **change)], ["train"])
    assert verify(folder) == []
    assert message in verify(folder, full=True)[0]


def test_full_verification_holds_arrays_against_their_digest(tmp_path, monkeypatch):
    with monkeypatch.context() as patch:
        patch.setattr("meshshard.sample.Sample.digest", "0" * 64)
        write_dataset(tmp_path, [sample(0)], ["train"])
    assert verify(tmp_path) == []
    assert "mesh000: its arrays do not match their stored digest" in verify(tmp_path, full=True)[0]


def test_publish_keeps_the_old_file_when_the_disk_is_full(tmp_path, monkeypatch):
    path = tmp_path / "a"
    publish(path, b"old")
    for name in ("write", "fsync"):
        with monkeypatch.context() as patch:
            patch.setattr(f"meshshard.files.os.{name}", lambda *_: (_ for _ in ()).throw(OSError(28, "full")))
            with pytest.raises(OSError, match="full"):
                publish(path, b"new")
        assert [p.name for p in tmp_path.iterdir()] == ["a"]
        assert path.read_bytes() == b"old"


def test_publish_survives_short_writes(tmp_path, monkeypatch):
    original = os.write
    monkeypatch.setattr("meshshard.files.os.write", lambda descriptor, data: original(descriptor, data[:3]))
    publish(tmp_path / "a", b"0123456789")
    assert (tmp_path / "a").read_bytes() == b"0123456789"
