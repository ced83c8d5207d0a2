"""The little of HDF5 that a shard uses, read without its library, which damage and malice can kill.

Superblock 2 or 3, object headers 2, links in headers or in a fractal heap, attributes in headers, contiguous data.
Names are those of the HDF5 File Format Specification 3.0, https://docs.hdfgroup.org/hdf5/v1_14/_f_m_t3.html.
"""

import math
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from mmap import mmap

from meshshard.errors import InvalidShard

SIGNATURE = b"\x89HDF\r\n\x1a\n"
UNDEFINED = 2**64 - 1
MAX_MESSAGES = 1000
"""Of one object header."""

DATASPACE, LINK_INFO, DATATYPE, EXTERNAL_FILES, LINK, LAYOUT, ATTRIBUTE, CONTINUATION = 1, 2, 3, 7, 6, 8, 12, 16
CONTIGUOUS = 1
SHARED = 2
"""Bit of a message's flags: its body lies elsewhere."""


def _integer(size: int) -> bytes:
    return struct.pack("<B3BIHH", 0, 0x08, 0, 0, size, 0, 8 * size)


def _float(size: int, exponent: int, mantissa: int) -> bytes:
    bits = 8 * size
    bias = 2 ** (exponent - 1) - 1
    return struct.pack("<B3BIHH4BI", 1, 0x20, bits - 1, 0, size, 0, bits, mantissa, exponent, 0, mantissa, bias)


TYPES = {
    **{_integer(size): f"i{size}" for size in (1, 2, 4, 8)},
    _float(4, 8, 23): "f4",
    _float(8, 11, 52): "f8",
}
"""Body of a datatype message, without version -> numpy's name. Signed and little-endian; all else is another type."""

STRING_CLASS, NULL_PADDED = 3, 1
MAX_STRING = 2**20


@dataclass
class _Cursor:
    """A place in bytes, which moves with what is taken."""

    data: bytes | mmap
    at: int = 0

    def take(self, count: int) -> bytes:
        if not 0 <= self.at <= self.at + count <= len(self.data):
            raise InvalidShard("a part of its HDF5 metadata reaches beyond its end")
        self.at += count
        return self.data[self.at - count : self.at]

    def number(self, size: int) -> int:
        return int.from_bytes(self.take(size), "little")

    def expect(self, wanted: bytes, what: str) -> None:
        found = self.take(len(wanted))
        if found != wanted:
            raise InvalidShard(f"{what} begins with {found!r}, not with {wanted!r} as in HDF5's latest format")


@dataclass(frozen=True, kw_only=True)
class DataSet:
    """An array in the file. `kind` is numpy's name of its type, or says that it is another; `offset` is where its
    bytes begin, None where they lie outside or in pieces."""

    shape: tuple[int, ...]
    kind: str
    offset: int | None


@dataclass(frozen=True, kw_only=True)
class Root:
    """The root group. `links`: name -> address of an object header, None for a link that is not hard.
    `attributes`: name -> kind and bytes of those with one value."""

    links: dict[str, int | None]
    attributes: dict[str, tuple[str, bytes]]


def read_root(data: mmap) -> Root:
    """Links and attributes of a file. InvalidShard: not HDF5's latest format, from its first byte to its last one."""
    cursor = _Cursor(data)
    if cursor.take(8) != SIGNATURE:
        raise InvalidShard("this is no HDF5 file: it does not begin as one")
    version, offsets, lengths, _ = cursor.take(4)
    base, extension, end, root = (cursor.number(8) for _ in range(4))
    if version not in (2, 3) or (offsets, lengths, base, extension) != (8, 8, 0, UNDEFINED):
        raise InvalidShard(
            f"its HDF5 superblock has version {version}; a shard is written in HDF5's latest format (2 or 3), "
            "without user block or extension"
        )
    if end != len(data):
        raise InvalidShard(f"it has {len(data)} bytes, its HDF5 superblock says {end}: it was cut, or goes on")
    links: dict[str, int | None] = {}
    attributes = {}
    for kind, body in _messages(data, root):
        if kind == LINK:
            links.update([_link(body)])
        elif kind == LINK_INFO:
            links.update(_dense_links(data, body))
        elif kind == ATTRIBUTE:
            name, value = _attribute(body)
            attributes[name] = value
    return Root(links=links, attributes=attributes)


def read_dataset(data: mmap, address: int) -> DataSet:
    """What the object header at `address` says. InvalidShard: it is not one of a data set."""
    messages = dict(_messages(data, address))
    if not {DATASPACE, DATATYPE, LAYOUT} <= set(messages):
        raise InvalidShard("it is not a data set")
    layout = _Cursor(messages[LAYOUT])
    version, storage = layout.take(2)
    inside = version in (3, 4) and storage == CONTIGUOUS and EXTERNAL_FILES not in messages
    return DataSet(
        shape=_shape(messages[DATASPACE]),
        kind=_kind(messages[DATATYPE]),
        offset=layout.number(8) if inside else None,
    )


def _messages(data: mmap, address: int) -> Iterator[tuple[int, bytes]]:
    """Type and body of every message of an object header."""
    cursor = _Cursor(data, address)
    cursor.expect(b"OHDR\x02", "an object header")
    flags = cursor.number(1)
    cursor.take((16 if flags & 0x20 else 0) + (4 if flags & 0x10 else 0))  # times; when attributes become dense
    chunks = [(cursor, cursor.number(1 << (flags & 3)))]
    head = 6 if flags & 0x04 else 4  # with or without order of creation
    for _ in range(MAX_MESSAGES):
        while chunks and chunks[-1][1] < head:
            chunks.pop()
        if not chunks:
            return
        cursor, left = chunks.pop()
        kind, size, flags = struct.unpack("<BHB", cursor.take(head)[:4])
        body = cursor.take(size)
        chunks.append((cursor, left - head - size))
        if flags & SHARED:
            raise InvalidShard("a type or size of it lies elsewhere: it is shared with another object")
        if kind == CONTINUATION:
            place = _Cursor(body)
            further, length = _Cursor(data, place.number(8)), place.number(8)
            further.expect(b"OCHK", "the continuation of an object header")
            chunks.append((further, length - 8))
        else:
            yield kind, body
    raise InvalidShard(f"an object header has more than {MAX_MESSAGES} messages")


def _shape(body: bytes) -> tuple[int, ...]:
    cursor = _Cursor(body)
    version, rank, _, space = cursor.take(4)
    if version != 2 or space not in (0, 1):
        raise InvalidShard("its dataspace is neither one value nor an array")
    return tuple(cursor.number(8) for _ in range(rank))


def _kind(body: bytes) -> str:
    """numpy's name of a type: i2, f4, S12 (bytes padded with zeros); else "HDF5 class n"."""
    if len(body) < 8:
        raise InvalidShard("its type is cut short")
    number, size = body[0] & 15, int.from_bytes(body[4:8], "little")
    if number == STRING_CLASS and body[1] & 15 == NULL_PADDED and 0 < size <= MAX_STRING:
        return f"S{size}"
    return TYPES.get(bytes([number]) + body[1:], f"HDF5 class {number}")


def _attribute(body: bytes) -> tuple[str, tuple[str, bytes]]:
    cursor = _Cursor(body)
    if cursor.take(2) != b"\x03\x00":
        raise InvalidShard("a root attribute is not one of HDF5's latest format")
    sizes = [cursor.number(2) for _ in range(3)]
    cursor.take(1)  # encoding of the name
    name, kind, space = (cursor.take(size) for size in sizes)
    many = math.prod(_shape(space))
    return _text(name.rstrip(b"\0")), (_kind(kind) if many == 1 else f"array of {many}", body[cursor.at :])


def _text(name: bytes) -> str:
    return name.decode(errors="backslashreplace")


def _link(body: bytes) -> tuple[str, int | None]:
    cursor = _Cursor(body)
    cursor.expect(b"\x01", "a link")
    flags = cursor.number(1)
    hard = not flags & 0x08 or cursor.number(1) == 0
    cursor.take((8 if flags & 0x04 else 0) + (1 if flags & 0x10 else 0))  # order of creation, encoding
    name = cursor.take(cursor.number(1 << (flags & 3)))
    return _text(name), cursor.number(8) if hard else None


def _dense_links(data: mmap, body: bytes) -> Iterator[tuple[str, int | None]]:
    """Links beyond the eighth: a tree that is sorted by name says where in a heap each lies."""
    cursor = _Cursor(body)
    _, flags = cursor.take(2)
    cursor.take(8 if flags & 1 else 0)
    heap, tree = cursor.number(8), cursor.number(8)
    if heap != UNDEFINED:
        blocks = _heap_blocks(data, heap)
        for offset, length in _heap_ids(data, tree):
            for first, size, address in blocks:
                if first <= offset < first + size:
                    yield _link(_Cursor(data, address + offset - first).take(length))


def _heap_ids(data: mmap, address: int) -> Iterator[tuple[int, int]]:
    """Offset and length of every link, from a version 2 B-tree of one level or two."""
    cursor = _Cursor(data, address)
    cursor.expect(b"BTHD\x00\x05", "the tree of links")
    node_size, record_size, depth = struct.unpack("<IHH", cursor.take(8))
    cursor.take(2)
    root, count = cursor.number(8), cursor.number(2)
    if record_size != 11 or node_size > 512 or depth > 1:
        raise InvalidShard("its root group has too many links")
    if root == UNDEFINED:
        return
    most = (node_size - 10) // record_size
    leaves = [(root, count)]
    if depth == 1:
        node = _Cursor(data, root)
        node.expect(b"BTIN\x00\x05", "a node of the tree of links")
        records = node.take(11 * count)
        leaves = [(node.number(8), node.number(1)) for _ in range(count + 1)]
        yield from _ids(records)
    if max(count if depth else 0, *(number for _, number in leaves)) > most or len(set(leaves)) < len(leaves):
        raise InvalidShard("a node of its tree of links has more records than room, or is there twice")
    for place, number in leaves:
        leaf = _Cursor(data, place)
        leaf.expect(b"BTLF\x00\x05", "a leaf of the tree of links")
        yield from _ids(leaf.take(11 * number))


def _ids(records: bytes) -> Iterator[tuple[int, int]]:
    for _, version, offset, length in struct.iter_unpack("<IBIH", records):
        if version == 0:  # a managed object; links never are huge or tiny ones
            yield offset, length


def _heap_blocks(data: mmap, address: int) -> list[tuple[int, int, int]]:
    """First offset, size and address of every direct block of a fractal heap."""
    cursor = _Cursor(data, address)
    cursor.expect(b"FRHP\x00", "the heap of links")
    ids, filters, _, _ = struct.unpack("<HHBI", cursor.take(9))
    cursor.take(12 * 8)
    width, smallest, largest, bits, _, root, rows = struct.unpack("<HQQHHQH", cursor.take(32))
    if (ids, filters, width, smallest, largest, bits) != (7, 0, 4, 512, 2**16, 32):
        raise InvalidShard("its root group is not stored as HDF5 stores groups")
    if rows == 0:
        return [(0, smallest, root)]
    if rows > 9:  # from there on, rows of smaller tables
        raise InvalidShard("its root group has too many links")
    table = _Cursor(data, root)
    table.expect(b"FHIB\x00", "the table of the heap of links")
    table.take(8 + 4)
    blocks, first = [], 0
    for row in range(rows):
        size = smallest << max(0, row - 1)
        for _ in range(width):
            blocks.append((first, size, table.number(8)))
            first += size
    return blocks
