"""The form "lines": a text file with one label a line, an integer or a name."""

import codecs
import re

import numpy as np

from meshshard_prep.labels.written import Written


def read_lines(data: bytes, _name: str, place: str) -> Written:
    """One label a line; empty lines may only end the file. What is no integer is a name."""
    lines = data.removeprefix(codecs.BOM_UTF8).rstrip().splitlines()
    distinct: dict[bytes, int] = {}
    which = np.array([distinct.setdefault(line.strip(), len(distinct)) for line in lines], dtype=np.int64)
    return Written(values=tuple(map(value_of, distinct)), which=which, place=lambda i: f"{place}:{i + 1}")


def value_of(text: bytes) -> int | str:
    """A decimal integer, also as 1.0 or 1.000e+00, which numpy.savetxt writes; else a name. 1_0, which Python would
    take, is a name."""
    if re.fullmatch(rb"[+-]?[0-9]{1,1000}", text):
        return int(text)
    if re.fullmatch(rb"[+-]?[0-9]{1,15}(\.[0-9]{0,30})?([eE][+-]?[0-9]{1,2})?", text) and float(text).is_integer():
        return int(float(text))
    return text.decode(errors="replace")
