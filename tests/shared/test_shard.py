"""Writer and reader, side by side."""

import pickle
from dataclasses import fields, replace

import h5py
import numpy as np
import pytest
from samples import PAPER, sample

from meshshard.errors import InvalidShard
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
    assert travelled._columns is None
    assert_same(travelled[1], opened)


def test_every_flipped_bit_is_noticed(shard_file):
    """By the index's sha256: the reader believes nothing before."""
    whole = shard_file.read_bytes()
    rng = np.random.default_rng(0)
    for place in rng.integers(0, len(whole), 200):
        damaged = bytearray(whole)
        damaged[place] ^= 1 << int(rng.integers(8))
        shard_file.write_bytes(damaged)
        with pytest.raises(InvalidShard, match="the file is damaged: its sha256 is"):
            Shard(shard_file, sha256_of(whole))[0]


@pytest.mark.parametrize("content", [b"", b"not HDF5", b"\x89HDF\r\n\x1a\n" + b"\0" * 200])
def test_other_files_are_refused(tmp_path, content):
    (tmp_path / "a.h5").write_bytes(content)
    with pytest.raises(InvalidShard, match="not a readable HDF5 file"):
        Shard(tmp_path / "a.h5")[0]


def test_missing_file(tmp_path):
    with pytest.raises(InvalidShard, match="cannot be read: No such file"):
        Shard(tmp_path / "none.h5", "0" * 64)[0]
    with pytest.raises(InvalidShard, match="not a readable HDF5 file"):
        Shard(tmp_path / "none.h5")[0]


def swap(file, name, make):
    del file[name]
    make(file)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda f: f.attrs.__setitem__("format", np.bytes_("other")), "the format is 'other'"),
        (lambda f: f.attrs.__setitem__("format_version", 2), "format version 2; this meshshard reads version 1"),
        (lambda f: f.attrs.__delitem__("recipe"), "attribute 'recipe' is missing"),
        (lambda f: f.attrs.__setitem__("recipe", "variable length"), "neither a fixed string nor an integer"),
        (lambda f: f.__delitem__("hks"), "the field 'hks' is missing"),
        (lambda f: swap(f, "hks", lambda g: g.create_group("hks")), "'hks' is a Group, not a data set"),
        (
            lambda f: swap(f, "hks", lambda g: g.__setitem__("hks", h5py.SoftLink("/vertices"))),
            "'hks' is a link that leads elsewhere",
        ),
        (
            lambda f: swap(f, "hks", lambda g: g.__setitem__("hks", h5py.ExternalLink("other.h5", "/hks"))),
            "'hks' is a link that leads elsewhere",
        ),
        (
            lambda f: swap(
                f, "dihedral", lambda g: g.create_dataset("dihedral", data=np.ones(90, "f4"), chunks=(9,))
            ),
            "not stored in one piece inside the file",
        ),
        (
            lambda f: swap(
                f, "dihedral", lambda g: g.create_dataset("dihedral", (90,), "f4", external=[("/etc/passwd", 0, 360)])
            ),
            "not stored in one piece inside the file",
        ),
        (
            lambda f: swap(f, "dihedral", lambda g: g.create_dataset("dihedral", data=np.ones(90, "f8"))),
            "has the type float64, format 1 says f4",
        ),
        (
            lambda f: swap(f, "id", lambda g: g.create_dataset("id", data=["a", "b", "c"])),
            "format 1 says str",
        ),
        (
            lambda f: swap(f, "dihedral", lambda g: g.create_dataset("dihedral", data=np.ones(7, "f4"))),
            r"'dihedral' has the shape \(7,\)",
        ),
        (lambda f: f["vertex_ptr"].__setitem__(slice(None), [0, 90, 18, 90]), "'vertex_ptr' does not rise from 0"),
        (lambda f: f["vertex_ptr"].__setitem__(slice(None), [1, 18, 84, 90]), "'vertex_ptr' does not rise from 0"),
        (lambda f: f["face_ptr"].__setitem__(slice(None), [0, 1, 2, 10**15]), "has the shape"),
        (lambda f: f["id"].__setitem__(0, b"\xff\xfe"), "'id' is not UTF-8"),
    ],
)
def test_what_format_1_forbids_is_refused_by_name(shard_file, change, message):
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
