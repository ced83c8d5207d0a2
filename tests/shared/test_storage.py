"""Shards made by somebody who means harm: refused by name, nothing outside read, little memory and time spent."""

import ctypes
import os
import time

import h5py
import numpy as np
import pytest
from effort import times
from hdf5_metadata import metadata_blocks, seal
from opened import opened
from samples import PAPER, sample

from meshshard.errors import InvalidShard
from meshshard.reader import Shard
from meshshard.writer import shard_image

IMAGE = shard_image(
    [sample(n, level=0) for n in range(3)], recipe=PAPER, algorithm_version=1, classes=("low", "middle", "high")
)
"""Of 18 vertices and 24 faces."""

IN_OPEN = 0x20


@pytest.fixture
def outside(tmp_path):
    """A file that no shard has any business with; the test fails when anybody opens it."""
    path = tmp_path / "outside.h5"
    with h5py.File(path, "w") as file:
        file["hks"] = np.ones((18, 16), "f4")
    libc = ctypes.CDLL(None)
    watch = libc.inotify_init1(os.O_NONBLOCK)
    assert libc.inotify_add_watch(watch, bytes(path), IN_OPEN) > 0
    yield path
    with pytest.raises(BlockingIOError):  # nothing to tell
        os.read(watch, 4096)
    path.read_bytes()
    assert os.read(watch, 4096)  # it does tell
    os.close(watch)


def replaced(name, make):
    """Put something else in a field's place."""

    def change(file, outside):
        del file[name]
        make(file, outside)

    return change


def virtual(file, outside):
    layout = h5py.VirtualLayout((18, 16), "f4", maxshape=(None, 16))
    layout[:, :] = h5py.VirtualSource(outside, "hks", (18, 16), "f4", maxshape=(None, 16))[:, :]
    file.create_virtual_dataset("hks", layout)


def other_type(kind, name="dihedral"):
    return replaced(name, lambda f, _: f.create_dataset(name, (18,), kind))


def compact(file, _):
    plan = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    plan.set_layout(h5py.h5d.COMPACT)
    space = h5py.h5s.create_simple((18,))
    h5py.h5d.create(file.id, b"dihedral", h5py.h5t.IEEE_F32LE, space, plan)


def loop(file, _):
    file["hks"] = file["/"]


def named_type(file, _):
    file["type"] = np.dtype("f4")
    file.create_dataset("dihedral", (18,), file["type"])


def many_attributes(file, _):
    for number in range(300):
        file.attrs[f"a{number}"] = number


def many_links(file, _):
    for number in range(3000):
        file[f"a{number}"] = h5py.SoftLink("/hks")


HOSTILE = {
    "external link": (
        replaced("hks", lambda f, outside: f.__setitem__("hks", h5py.ExternalLink(str(outside), "/hks"))),
        "'hks': it is a link that leads elsewhere; format 1 has hard links only",
    ),
    "soft link": (replaced("hks", lambda f, _: f.__setitem__("hks", h5py.SoftLink("/vertices"))), "leads elsewhere"),
    "dangling link": (replaced("hks", lambda f, _: f.__setitem__("hks", h5py.SoftLink("/etc"))), "leads elsewhere"),
    "external storage": (
        replaced("hks", lambda f, o: f.create_dataset("hks", (18, 16), "f4", external=[(str(o), 0, 1152)])),
        "'hks': it is not stored in one piece inside the file",
    ),
    "virtual": (replaced("hks", virtual), "'hks': it is not stored in one piece inside the file"),
    "group": (replaced("hks", lambda f, _: f.create_group("hks")), "'hks': it is not a data set"),
    "cycle": (replaced("hks", loop), "'hks': it is not a data set"),
    "missing": (replaced("hks", lambda *_: None), "the field 'hks' is missing"),
    "chunked": (
        replaced("dihedral", lambda f, _: f.create_dataset("dihedral", data=np.ones(18, "f4"), chunks=(9,))),
        "'dihedral': it is not stored in one piece",
    ),
    "compressed bomb": (
        replaced("dihedral", lambda f, _: f.create_dataset("dihedral", (2**38,), "f4", compression="gzip")),
        "'dihedral': it is not stored in one piece",
    ),
    "compact": (replaced("dihedral", compact), "'dihedral': it is not stored in one piece"),
    "2**60 elements": (
        replaced("dihedral", lambda f, _: f.create_dataset("dihedral", (2**58,), "f4")),
        r"'dihedral': its shape \(288230376151711744,\) reaches beyond the end of the file",
    ),
    "no elements of 2**60": (
        replaced("hks", lambda f, _: f.create_dataset("hks", (0, 2**60), "f4")),
        "'hks': its shape .* reaches beyond the end of the file",
    ),
    "rank 32": (
        replaced("dihedral", lambda f, _: f.create_dataset("dihedral", (1,) * 32, "f4")),
        "'dihedral': it has 32 axes, format 1 says 1",
    ),
    "scalar": (replaced("dihedral", lambda f, _: f.__setitem__("dihedral", np.float32(1))), "it has 0 axes"),
    "null": (
        replaced("dihedral", lambda f, _: f.__setitem__("dihedral", h5py.Empty("f4"))),
        "its dataspace is neither one value nor an array",
    ),
    "wrong axes": (
        replaced("dihedral", lambda f, _: f.create_dataset("dihedral", data=np.ones(7, "f4"))),
        r"'dihedral' has the shape \(7,\)",
    ),
    "double": (other_type("f8"), "'dihedral': its type is f8, format 1 says f4"),
    "half": (other_type("f2"), "'dihedral': its type is HDF5 class 1, format 1 says f4"),
    "big-endian": (other_type(">f4"), "its type is HDF5 class 1, format 1 says f4"),
    "compound": (other_type([("a", "f4")]), "its type is HDF5 class 6"),
    "opaque": (other_type("V4"), "its type is HDF5 class 5"),
    "enumeration": (other_type(h5py.enum_dtype({"a": 1})), "its type is HDF5 class 8"),
    "array type": (other_type("2f4"), "its type is HDF5 class 10"),
    "reference": (other_type(h5py.ref_dtype), "its type is HDF5 class 7"),
    "region reference": (other_type(h5py.regionref_dtype), "its type is HDF5 class 7"),
    "variable length": (other_type(h5py.vlen_dtype("f4")), "its type is HDF5 class 9"),
    "variable strings": (
        replaced("id", lambda f, _: f.create_dataset("id", data=["a", "b", "c"])),
        "'id': its type is HDF5 class 9, format 1 says str",
    ),
    "long strings": (
        replaced("id", lambda f, _: f.create_dataset("id", (3,), "S2147483647")),
        "'id': its type is HDF5 class 3, format 1 says str",
    ),
    "named type": (replaced("dihedral", named_type), "'dihedral': a type or size of it lies elsewhere"),
    "many attributes": (many_attributes, "'format' is missing: .* more than eight attributes"),
    "large attribute": (
        lambda f, _: f.attrs.__setitem__("recipe", np.bytes_("x" * 200_000)),
        "'format' is missing: .* or with one above 64 KB",
    ),
    "many links": (many_links, "its root group has too many links"),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_shards_are_refused_by_name(tmp_path, outside, name):
    change, message = HOSTILE[name]
    with pytest.raises(InvalidShard, match=message):
        Shard(changed(tmp_path / "a.h5", change, outside))[0]


def changed(path, change, outside):
    path.write_bytes(IMAGE)
    with h5py.File(path, "r+", libver="latest") as file:
        change(file, outside)
    return path


@pytest.mark.soak
def test_hostile_shards_take_little_memory_and_time(tmp_path, outside, measured):
    """All of them in one process that may take 64 MB, in a few seconds."""
    paths = [changed(tmp_path / f"{n}.h5", change, outside) for n, (change, _) in enumerate(HOSTILE.values())]
    start = time.perf_counter()
    results = opened(paths, seconds=30, memory=64 * 2**20)
    assert all(line.startswith("InvalidShard: ") for line in results)
    measured("R9", f"{len(paths)} crafted shards refused within 64 MB, {time.perf_counter() - start:.1f} s in all")


def test_fields_on_top_of_each_other_are_refused(tmp_path):
    """Else a small file would be a large data set."""
    path = tmp_path / "a.h5"
    path.write_bytes(shard_image([sample(0, level=4)], recipe=PAPER, algorithm_version=1, classes=("a", "b", "c")))
    with h5py.File(path, "r+", libver="latest") as file:
        file["eigenvectors"] = file["hks"]
        file["eigenvalues"] = np.zeros((1, 16))
    with pytest.raises(InvalidShard, match=r"its fields together are larger than its .* bytes"):
        Shard(path)[0]


BLOCKS = metadata_blocks(IMAGE)
KINDS = 5


def mutated(seed):
    """A shard with a flipped bit, a zeroed span, a cut, a part copied elsewhere, or metadata that was changed and got
    its checksum anew."""
    rng = np.random.default_rng(seed)
    image = bytearray(IMAGE)
    place, length = int(rng.integers(len(image))), int(rng.integers(1, 4097))
    match seed % KINDS:
        case 0:
            image[place] ^= 1 << int(rng.integers(8))
        case 1:
            image[place : place + length] = bytes(len(image[place : place + length]))
        case 2:
            del image[place:]
        case 3:
            part = IMAGE[place : place + length]
            there = int(rng.integers(len(image) - len(part) + 1))
            image[there : there + len(part)] = part
        case _:
            for start, end in rng.choice(BLOCKS, 2):
                place, length = int(rng.integers(start, end)), int(rng.choice([1, 2, 4, 8]))
                value = bytes([rng.choice([0, 1, 2, 127, 128, 255])]) * 8 if rng.random() < 0.7 else rng.bytes(8)
                image[place : min(place + length, end)] = value[: min(length, end - place)]
                seal(image, (start, end))
    return image


@pytest.mark.soak
def test_mutated_shards_are_refused_or_consistent(tmp_path, measured):
    """Opened without a checksum; a crash, a hang or another exception fails, and names its seed."""
    count, batch = times(400, 20_000), 400
    whole = 0
    for first in range(0, count, batch):
        paths = [tmp_path / f"seed-{seed}.h5" for seed in range(first, first + batch)]
        for seed, path in enumerate(paths, first):
            path.write_bytes(mutated(seed))
        results = opened(paths)
        whole += results.count("whole")
        for path in paths:
            path.unlink()
    assert 0 < whole < count
    measured("R9", f"{count} mutated shards, {count - whole} refused by name, {whole} read as consistent samples")
