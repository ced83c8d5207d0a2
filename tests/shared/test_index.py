import json
from dataclasses import replace

import numpy as np
import pytest
from samples import sample, toy_dataset

from meshshard import open_dataset
from meshshard.errors import InvalidShard, UsageError
from meshshard.files import publish
from meshshard.index import Index, Rejection, _sealed, read_index
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


def test_every_changed_character_is_noticed(tmp_path):
    """Whatever still parses to other content is refused; white space may change."""
    text = (toy_dataset(tmp_path) / "index.json").read_text()
    original = read_index(tmp_path)
    rng = np.random.default_rng(0)
    for place in rng.integers(0, len(text), 300):
        (tmp_path / "index.json").write_text(text[:place] + chr(32 + rng.integers(94)) + text[place + 1 :])
        try:
            assert read_index(tmp_path) == original
        except InvalidShard:
            continue


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", "not the index of a meshshard folder"),
        ("[]", "not the index of a meshshard folder"),
        ("{}", "not the index of a meshshard folder"),
        ('{"sha256": "0", "format": "other"}', "format 'other' version None"),
    ],
)
def test_other_files_are_refused(tmp_path, content, message):
    (tmp_path / "index.json").write_text(content)
    with pytest.raises(InvalidShard, match=message):
        read_index(tmp_path)


def test_a_sealed_index_that_lacks_a_part_is_refused(tmp_path):
    table = json.loads(read_index(toy_dataset(tmp_path)).to_bytes())
    del table["shards"], table["sha256"]
    (tmp_path / "index.json").write_text(json.dumps(table | {"sha256": _sealed(table)}))
    with pytest.raises(InvalidShard, match="a part of the index is missing"):
        read_index(tmp_path)


def test_no_index_says_what_to_type(tmp_path):
    with pytest.raises(UsageError, match="meshshard features DATASET --out"):
        open_dataset(tmp_path)
    (tmp_path / "index.json").mkdir()
    with pytest.raises(UsageError, match="cannot be read"):
        read_index(tmp_path)


def test_newer_version_is_refused(tmp_path):
    table = json.loads(Index.to_bytes(read_index(toy_dataset(tmp_path))))
    (tmp_path / "index.json").write_text(json.dumps(table | {"format_version": 2}))
    with pytest.raises(InvalidShard, match="version 2; this meshshard reads 'meshshard-index' version 1"):
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
        ({"faces": np.full((32, 3), 99, dtype="i4")}, "a face names a vertex outside 0..17"),
        ({"dihedral": np.full(18, np.nan, dtype="f4")}, "dihedral is not finite"),
        ({"face_labels": np.full(32, 3, dtype="i2")}, "face_labels outside -1..2"),
        ({"mesh_label": 7}, "mesh_label 7 outside -1..2"),
    ],
)
def test_full_verification_looks_into_the_arrays(tmp_path, change, message):
    from samples import write_dataset

    folder = write_dataset(tmp_path, [replace(sample(0), **change)], ["train"])
    assert verify(folder) == []
    assert message in verify(folder, full=True)[0]


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
    import os

    original = os.write
    monkeypatch.setattr("meshshard.files.os.write", lambda descriptor, data: original(descriptor, data[:3]))
    publish(tmp_path / "a", b"0123456789")
    assert (tmp_path / "a").read_bytes() == b"0123456789"
