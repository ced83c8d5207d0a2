"""Writer and reader, side by side."""

import errno
import os
import pickle
from dataclasses import fields, replace
from pathlib import Path

import h5py
import numpy as np
import pytest
from samples import PAPER, sample

from meshshard.errors import InvalidShard, UsageError
from meshshard.files import sha256_of
from meshshard.reader import Shard
from meshshard.sample import Sample
from meshshard.schema import ATTRIBUTES, FIELDS
from meshshard.writer import shard_image

CLASSES = ("low", "middle", "hïgh")


def image(samples):
    return shard_image(samples, recipe=PAPER, algorithm_version=3, classes=CLASSES)


@pytest.fixture
def shard_file(tmp_path):
    path = tmp_path / "a.h5"
    path.write_bytes(image([sample(1), sample(2, level=2), sample(0, level=0)]))
    return path


def assert_same(found: Sample, expected: Sample):
    for field in fields(Sample):
        a, b = getattr(found, field.name), getattr(expected, field.name)
        if isinstance(b, np.ndarray):
            assert a.dtype == b.dtype
            np.testing.assert_array_equal(a, b)
        else:
            assert a == b, field.name


def test_what_is_written_is_read(tmp_path):
    samples = [
        sample(0, split="train", group="ä b", mesh_label=2),
        sample(1, level=2, split="test", vertex_labels=np.arange(66, dtype="i2") % 3),
    ]
    samples[0] = replace(samples[0], vertex_labels=np.zeros(18, dtype="i2"))
    (tmp_path / "a.h5").write_bytes(image(samples))
    shard = Shard(tmp_path / "a.h5")
    assert len(shard) == 2
    assert (shard.recipe, shard.classes, shard.algorithm_version) == (PAPER, CLASSES, 3)
    for row, expected in enumerate(samples):
        assert_same(shard[row], expected)
        assert shard[row].digest == expected.digest == shard.stored_digest(row)
    with pytest.raises(IndexError, match="holds 2 meshes, number 2"):
        shard[2]


def test_same_samples_same_bytes_in_any_order():
    samples = [sample(n) for n in range(4)]
    assert image(samples) == image(samples[::-1]) == image([replace(s) for s in samples])
    assert image(samples) != image([replace(samples[0], scale=2.0), *samples[1:]])


def test_the_file_is_nothing_but_the_table(shard_file):
    with h5py.File(shard_file) as file:
        assert set(file.attrs) == set(ATTRIBUTES)
        assert set(file) == {f.name for f in FIELDS if f.required} | {"face_labels"}
        for name, data in file.items():
            assert data.id.get_create_plist().get_layout() == h5py.h5d.CONTIGUOUS, name


def test_digest_covers_arrays_and_not_names():
    first = sample(0)
    assert replace(first, id="x", split="test", source="y").digest == first.digest
    assert replace(first, hks=first.hks + 1).digest != first.digest
    assert replace(first, face_labels=None).digest != first.digest
    assert replace(first, diagnostics={**first.diagnostics, "components": 9}).digest != first.digest


def test_arrays_are_mapped_and_read_only(shard_file):
    loaded = Shard(shard_file)[0]
    with pytest.raises(ValueError, match="read-only"):
        loaded.hks[0, 0] = 1


def test_a_shard_travels_closed_and_opens_there(shard_file):
    shard = Shard(shard_file, sha256_of(shard_file.read_bytes()))
    opened = shard[1]
    travelled = pickle.loads(pickle.dumps(shard))  # noqa: S301  our own bytes
    assert travelled._content is None
    assert_same(travelled[1], opened)


def test_the_promised_hash_comes_first(shard_file):
    whole = shard_file.read_bytes()
    shard_file.write_bytes(whole[:-1])
    with pytest.raises(InvalidShard, match="the file is damaged: its sha256 is"):
        Shard(shard_file, sha256_of(whole))[0]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "it is empty"),
        (b"not HDF5", "this is no HDF5 file"),
        (b"\x89HDF\r\n\x1a\n" + b"\0" * 200, "superblock has version 0"),
        (b"\x89HDF\r\n\x1a\n\3", "reaches beyond its end"),
    ],
)
def test_other_files_are_refused(tmp_path, content, message):
    (tmp_path / "a.h5").write_bytes(content)
    with pytest.raises(InvalidShard, match=message):
        Shard(tmp_path / "a.h5")[0]


def test_missing_file(tmp_path):
    with pytest.raises(InvalidShard, match="cannot be read: No such file"):
        Shard(tmp_path / "none.h5", "0" * 64)[0]


def test_what_is_no_file_is_refused_without_waiting_for_it(tmp_path):
    os.mkfifo(tmp_path / "pipe.h5")
    for path in (tmp_path, tmp_path / "pipe.h5", Path("/dev/zero")):
        with pytest.raises(InvalidShard, match="cannot be read: it is no regular file"):
            Shard(path)[0]


def test_too_many_open_files_are_no_damage(shard_file, monkeypatch):
    def full(*_, **__):
        raise OSError(errno.EMFILE, "Too many open files")

    monkeypatch.setattr("meshshard.reader.open_regular", full)
    with pytest.raises(UsageError, match="Too many open files; raise the limit: ulimit -n"):
        Shard(shard_file)[0]


def put(name, place, value):
    def change(file):
        file[name][place] = value

    return change


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda f: f.attrs.__setitem__("format", np.bytes_("other")), "the format is 'other'"),
        (lambda f: f.attrs.__setitem__("format_version", 2), "format version 2; this meshshard reads version 1"),
        (lambda f: f.attrs.__setitem__("algorithm_version", np.bytes_("1")), "'algorithm_version' is no integer"),
        (lambda f: f.attrs.__delitem__("recipe"), "the root attribute 'recipe' is missing"),
        (lambda f: f.attrs.__setitem__("recipe", "variable length"), "neither a fixed string nor an integer"),
        (lambda f: f.attrs.__setitem__("recipe", 7), "not what JSON says"),
        (lambda f: f.attrs.__setitem__("recipe", np.bytes_('{"name": 3}')), "name is of type str, not 3"),
        (lambda f: f.attrs.__setitem__("recipe", np.bytes_("[" * 60_000)), "maximum recursion depth"),
        (lambda f: f.attrs.__setitem__("classes", np.bytes_('{"a": 1}')), "'classes' is no list of names"),
        (lambda f: f.attrs.__setitem__("classes", np.bytes_("[1, 2]")), "'classes' is no list of names"),
        (lambda f: f.attrs.__setitem__("classes", np.bytes_('["low"]')), "'face_labels' has a label outside -1..0"),
        (put("vertex_ptr", slice(None), [0, 90, 18, 90]), "'vertex_ptr' does not rise from 0"),
        (put("vertex_ptr", slice(None), [1, 18, 84, 90]), "'vertex_ptr' does not rise from 0"),
        (put("vertex_ptr", slice(None), [0, 2**63 - 1, -(2**63) + 9, 90]), "'vertex_ptr' does not rise from 0"),
        (put("face_ptr", slice(None), [0, 1, 2, 10**15]), "has the shape"),
        (put("id", 0, b"\xff\xfe"), "'id' is not UTF-8"),
        (put("id", 0, b"a\0b"), "'id' has a zero inside a string"),
        (put("id", 0, b"mesh001"), "not sorted by 'id', each once"),
        (put("faces", (3, 1), 6), "'faces' has an index outside its mesh"),
        (put("faces", (3, 1), -1), "'faces' has an index outside its mesh"),
        (put("face_adjacency", (3, 1), 8), "'face_adjacency' has an index outside its mesh"),
        (put("face_adjacency", (3, 1), -2), "'face_adjacency' has an index outside its mesh"),
        (put("face_source", 7, 8), "'face_source' has a polygon that the mesh file does not have"),
        (put("polygons", 0, 2**31 - 1), "'polygons' is more than the triangles there were"),
        (put("label_domain", 0, b"side"), "'label_domain' is 'side'"),
        (put("face_source", 7, -1), "'face_source' has a polygon that the mesh file does not have"),
        (lambda f: f.create_dataset("vertex_source", data=np.full(90, -1, "<i4")), "'vertex_source' has a negative"),
        (
            lambda f: f.attrs.__setitem__("recipe", np.bytes_(replace(PAPER, steps=("weld",)).to_json())),
            "'vertex_source' is missing, and the recipe has steps",
        ),
        (put("face_labels", 5, 3), r"'face_labels' has a label outside -1\.\.2"),
        (put("mesh_label", 0, -2), r"'mesh_label' has a label outside -1\.\.2"),
        (put("scale", 0, np.nan), "'scale' has a number that is not finite"),
        (put("scale", 0, 0.0), "'scale' has a number that is not above 0"),
        (put("centre", (0, 1), np.inf), "'centre' has a number that is not finite"),
        (put("times", 0, 0.5), r"'times' is \[0.5, .* its recipe says \[0.01,"),
    ],
)
def test_values_that_format_1_forbids_are_refused_by_name(shard_file, change, message):
    with h5py.File(shard_file, "r+", libver="latest") as file:
        change(file)
    with pytest.raises(InvalidShard, match=message):
        Shard(shard_file)[0]


def test_unknown_data_sets_are_ignored(shard_file):
    with h5py.File(shard_file, "r+", libver="latest") as file:
        file["mine"] = [1, 2, 3]
    assert len(Shard(shard_file)) == 3


@pytest.mark.parametrize(
    ("samples", "message"),
    [
        ([], "at least one sample"),
        ([sample(0), sample(0)], "two samples are called 'mesh000'"),
        ([sample(0), sample(1, labels=None)], "'mesh001' has no face_labels and other samples"),
        ([sample(0), replace(sample(1), times=np.ones(16))], "the samples of a shard have the same times"),
    ],
)
def test_the_writer_refuses_what_does_not_belong_together(samples, message):
    with pytest.raises(ValueError, match=message):
        image(samples)
