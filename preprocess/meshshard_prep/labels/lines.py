"""The form "lines": a text file with one label a line, an integer or a name."""

import codecs

import numpy as np

from meshshard_prep.labels.written import Written


def read_lines(data: bytes, _name: str, place: str) -> Written:
    """One label a line; empty lines may only end the file. What is no integer is a name."""
    lines = data.removeprefix(codecs.BOM_UTF8).rstrip().splitlines()
    distinct: dict[bytes, int] = {}
    which = np.array([distinct.setdefault(line.strip(), len(distinct)) for line in lines], dtype=np.int64)
    return Written(values=tuple(map(value_of, distinct)), which=which, place=lambda i: f"{place}:{i + 1}")


def value_of(text: bytes) -> int | str:
    """A decimal integer, or a name; 1_0, which Python would take, is a name."""
    try:
        return int(text) if b"_" not in text else text.decode()
    except ValueError:
        return text.decode(errors="replace")
