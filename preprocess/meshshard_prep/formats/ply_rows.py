"""Rows of a binary PLY that all have the same size, as those of triangles have: read at once, not one by one."""

import numpy as np

from meshshard_prep.formats.ply_header import BYTES, INTEGERS, Header

LONGEST_LIST = 1000
"""Longer lists are left to the reader of single rows: numpy's rows have at most 2 GiB."""


def even_rows(body: bytes, header: Header) -> dict[str, np.ndarray] | None:
    """Element -> its rows as a structured array, columns under the names of `Header.key_of`. None where a list has
    another length than in the first row of its element, the rows do not end where the file does, or plyfile would
    not take the header.

    A row as large as the first begins where the one before it ends: so lengths that are all equal there are the
    lengths.
    """
    if not header.for_plyfile().isascii():
        return None
    found, start = {}, 0
    for name, element in header.elements.items():
        row = _type_of_first_row(body, start, name, header)
        if row is None or start + element.rows * row.itemsize > len(body):
            return None
        rows = np.frombuffer(body, row, element.rows, start) if element.rows else np.empty(0, row)
        lengths = [rows[column] for column in row.names or () if column.startswith(" ")]
        if any((length != length[:1]).any() for length in lengths):
            return None
        found[name] = rows
        start += rows.nbytes
    return found if start == len(body) else None


def _type_of_first_row(body: bytes, start: int, name: str, header: Header) -> np.dtype | None:
    """The columns of the row that starts there, the length of a list before it under its name with a blank in front.
    None where one is there twice, or the row is too long."""
    order = ">" if header.format == "binary_big_endian" else "<"
    element = header.elements[name]
    columns: dict[str, tuple[str, tuple[int, ...]]] = {}
    at = start
    for number, column in enumerate(element.properties):
        key = header.key_of(name, number)
        shape: tuple[int, ...] = ()
        if key in columns:
            return None
        if column.length_type:
            length = BYTES[column.length_type]
            count = int.from_bytes(body[at : at + length], "big" if order == ">" else "little") if element.rows else 0
            if count > LONGEST_LIST:
                return None
            columns[f" {key}"] = (f"{order}u{length}", ())
            at += length
            shape = (count,)
        kind = "f" if column.type not in INTEGERS else "u" if column.type.startswith("u") else "i"
        columns[key] = (f"{order}{kind}{BYTES[column.type]}", shape)
        at += BYTES[column.type] * int(np.prod(shape))
    return np.dtype([(key, kind, shape) for key, (kind, shape) in columns.items()])
