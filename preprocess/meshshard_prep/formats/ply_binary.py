"""Rows of a binary PLY. Where each of them starts is found at once if they all have the same size, as triangles have,
and by one step after the other if lists make them differ; their columns are then read at once."""

from array import array
from typing import Literal

import numpy as np
from jaxtyping import Int64, Shaped

from meshshard_prep.formats.ply_columns import Column, Lists, spread, type_of
from meshshard_prep.formats.ply_header import BYTES, Element, Header
from meshshard_prep.formats.text import refusal


def binary_rows(body: bytes, header: Header, place: str) -> dict[str, list[Column]]:
    """Element -> its columns, from the bytes behind the header; InvalidMesh where they do not end with its rows."""
    order = ">" if header.format == "binary_big_endian" else "<"
    found, end = {}, 0
    for name, element in header.elements.items():
        starts = _row_starts(body, end, element, order)
        end = int(starts[-1])
        if end > len(body):
            row = int(np.argmax(starts[1:] > len(body)))
            rule = f"the rows of {name} are what the header says"
            raise refusal("truncated", rule, f"the file ends in row {row + 1} of {element.rows}", place)
        found[name] = _columns(body, starts[:-1], element, order)
    if left := len(body) - end:
        raise refusal("extra-data", "the file ends with its last row", f"{left} bytes follow", place)
    return found


def _columns(body: bytes, at: Int64[np.ndarray, " R"], element: Element, order: str) -> list[Column]:
    """The columns of rows that start there."""
    columns: list[Column] = []
    for column in element.properties:
        kind = type_of(column.type, order)
        if column.length_type:
            lengths = _lengths(body, at, column.length_type, order)
            at = at + BYTES[column.length_type]
            columns.append(Lists(lengths=lengths, values=_read(body, spread(at, lengths, kind.itemsize), kind)))
            at = at + lengths * kind.itemsize
        else:
            columns.append(_read(body, at, kind))
            at = at + kind.itemsize
    return columns


def _row_starts(body: bytes, start: int, element: Element, order: str) -> Int64[np.ndarray, " R1"]:
    """Where each row starts, and where the last one ends, which may be behind the end of the body."""
    steps, gap = [], 0  # bytes before the length of a list, of that length, and of each value
    for column in element.properties:
        if column.length_type:
            steps.append((gap, BYTES[column.length_type], BYTES[column.type]))
            gap = 0
        else:
            gap += BYTES[column.type]
    size = _steps(body, start, 1, steps, gap, order)[-1] - start if element.rows else 0
    even = start + size * np.arange(element.rows + 1)
    if not steps or (even[-1] <= len(body) and np.array_equal(_ends(body, even[:-1], element, order), even[1:])):
        return even
    return np.array(_steps(body, start, element.rows, steps, gap, order), dtype=np.int64)


def _steps(body: bytes, at: int, rows: int, steps: list[tuple[int, int, int]], last: int, order: str) -> "array[int]":
    """Row after row. Behind the end of the body, where no bytes are, lists count as empty."""
    byteorder: Literal["big", "little"] = "big" if order == ">" else "little"
    starts = array("q", [at])
    for _ in range(rows):
        for before, size, item in steps:
            at += before
            at += size + item * int.from_bytes(body[at : at + size], byteorder)
        at += last
        starts.append(at)
    return starts


def _ends(body: bytes, at: Int64[np.ndarray, " R"], element: Element, order: str) -> Int64[np.ndarray, " R"]:
    """Where rows that start there end: if that is where the next ones start, all of them start there."""
    for column in element.properties:
        if column.length_type:
            size = BYTES[column.length_type]
            inside = np.minimum(at, len(body) - size)  # a row that goes beyond ends beyond, whatever is read here
            at = at + size + BYTES[column.type] * _lengths(body, inside, column.length_type, order)
        else:
            at = at + BYTES[column.type]
    return at


def _lengths(body: bytes, at: Int64[np.ndarray, " R"], kind: str, order: str) -> Int64[np.ndarray, " R"]:
    return _read(body, at, type_of(kind, order, signed=False)).astype(np.int64)


def _read(body: bytes, at: Int64[np.ndarray, " N"], kind: np.dtype) -> Shaped[np.ndarray, " N"]:
    """The values at these bytes, through an array that has one at every byte."""
    return np.ndarray((max(len(body) - kind.itemsize + 1, 0),), kind, body, strides=(1,))[at]
