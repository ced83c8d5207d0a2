"""Our own reader of HDF5's metadata, held against HDF5's library."""

import mmap
import struct

import h5py
import numpy as np
import pytest

from meshshard.errors import InvalidShard
from meshshard.hdf5 import CONTINUATION, DATASPACE, DATATYPE, LAYOUT, read_dataset, read_root

NEWEST = [("v108", "v108"), ("v110", "v110"), ("v114", "v114"), "latest"]


def mapped(path):
    with path.open("rb") as stream:
        return mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ)


def assert_read_as_the_library_does(path):
    data = mapped(path)
    root = read_root(data)
    with h5py.File(path) as file:
        assert set(root.links) == set(file)
        for name, address in root.links.items():
            found, there = read_dataset(data, address), file[name]
            assert (found.shape, found.kind) == (there.shape, there.dtype.str.lstrip("<|"))
            if there.size:
                assert found.offset == there.id.get_offset()


@pytest.mark.parametrize("libver", NEWEST)
@pytest.mark.parametrize("count", [1, 8, 9, 40, 60, 300])
def test_links_of_any_number_in_any_order(tmp_path, libver, count):
    """In the header, in a heap of one block, of many; in a tree of one level or two; some taken away again."""
    rng = np.random.default_rng(count)
    with h5py.File(tmp_path / "a.h5", "w", libver=libver) as file:
        for number in rng.permutation(count):
            file[f"{'å' * (number % 30)}{number}"] = np.zeros(number % 4, "f4")
        for name in list(file)[: count // 4]:
            del file[name]
        file["late"] = [1]
    assert_read_as_the_library_does(tmp_path / "a.h5")


@pytest.mark.parametrize("kind", ["i1", "i2", "i4", "i8", "f4", "f8", "S1", "S300"])
@pytest.mark.parametrize("shape", [(1,), (0,), (7, 3), (0, 5), (2,) * 9])
def test_types_and_shapes(tmp_path, kind, shape):
    with h5py.File(tmp_path / "a.h5", "w", libver="latest") as file:
        file["x"] = np.zeros(shape, kind)
        file.create_dataset("with times and room", shape, kind, track_times=True, maxshape=shape)
    assert_read_as_the_library_does(tmp_path / "a.h5")


@pytest.mark.parametrize("kind", ["u4", ">i4", ">f8", "f2", "c8", "?", "V5", [("a", "f4")], "3f4"])
def test_other_types_are_told_from_ours(tmp_path, kind):
    with h5py.File(tmp_path / "a.h5", "w", libver="latest") as file:
        file.create_dataset("x", (3,), np.dtype(kind))
    data = mapped(tmp_path / "a.h5")
    assert read_dataset(data, read_root(data).links["x"]).kind.startswith("HDF5 class")


def test_attributes(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w", libver="latest") as file:
        file["x"] = 1
        file.attrs["fixed"] = np.bytes_("text")
        file.attrs["number"] = np.int64(-5)
        file.attrs["several"] = [1, 2]
        file.attrs["variable"] = "text"
    found = read_root(mapped(tmp_path / "a.h5")).attributes
    assert found["fixed"] == ("S4", b"text")
    assert found["number"] == ("i8", (-5).to_bytes(8, "little", signed=True))
    assert found["several"][0] == "array of 2"
    assert found["variable"][0] == "HDF5 class 9"


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"libver": "earliest"}, "superblock has version 0; a shard is written in HDF5's latest format"),
        ({"libver": "latest", "userblock_size": 512}, "it does not begin as one"),
        ({"libver": "latest", "fs_strategy": "page", "fs_persist": True}, "without user block or extension"),
    ],
)
def test_other_kinds_of_files_are_refused(tmp_path, settings, message):
    with h5py.File(tmp_path / "a.h5", "w", **settings) as file:
        file["x"] = 1
    with pytest.raises(InvalidShard, match=message):
        read_root(mapped(tmp_path / "a.h5"))


def test_objects_in_the_earliest_format_are_refused(tmp_path):
    """A new superblock does not make the objects behind it new."""
    with h5py.File(tmp_path / "a.h5", "w", libver="latest") as file:
        file["x"] = 1
    with h5py.File(tmp_path / "a.h5", "r+", libver="earliest") as file:
        file["y"] = 1
    data = mapped(tmp_path / "a.h5")
    with pytest.raises(InvalidShard, match=r"begins with .* not with b'OHDR.* as in HDF5's latest format"):
        read_dataset(data, read_root(data).links["y"])


def header(*messages, room=0):
    """An object header: type and body of each message, and bytes that it claims beyond them."""
    packed = b"".join(struct.pack("<BHB", kind, len(body), 0) + body for kind, body in messages)
    return b"OHDR\x02\x02" + struct.pack("<I", len(packed) + room) + packed


def mapped_bytes(content):
    data = mmap.mmap(-1, max(1, len(content)))
    data[: len(content)] = content
    return data


NOTHING = (0, b"")
CONTINUED = struct.pack("<QQ", 38, 40)
"""At byte 38, where `header((CONTINUATION, CONTINUED))` and 8 bytes of padding end, a chunk of 40 bytes."""
CHUNK = b"OCHK" + struct.pack("<BHB", CONTINUATION, 16, 0) + CONTINUED


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (header(), "it is not a data set"),
        (header(NOTHING), "it is not a data set"),
        (header(*[NOTHING] * 2000), "an object header has more than 1000 messages"),
        (header(NOTHING, room=100), "reaches beyond its end"),
        (header((CONTINUATION, CONTINUED)).ljust(38, b"\0") + CHUNK.ljust(60, b"\0"), "more than 1000 messages"),
        (header((CONTINUATION, struct.pack("<QQ", 2**64 - 1, 2**64 - 1))), "reaches beyond its end"),
        (header((CONTINUATION, b"")), "reaches beyond its end"),
        (header((DATASPACE, b""), (DATATYPE, b""), (LAYOUT, b"")), "reaches beyond its end"),
        (header((DATASPACE, b"\2\0\0\0"), (DATATYPE, b"\0"), (LAYOUT, b"\4\1" + bytes(16))), "its type is cut short"),
        (header((DATASPACE, b"\2\0\0\2"), (DATATYPE, b"\0"), (LAYOUT, b"\4\1")), "neither one value nor an array"),
        (b"OHDR\x02\x03" + b"\xff" * 30, "reaches beyond its end"),
    ],
)
def test_headers_that_lead_astray_end_in_a_sentence(content, message):
    with pytest.raises(InvalidShard, match=message):
        read_dataset(mapped_bytes(content), 0)
