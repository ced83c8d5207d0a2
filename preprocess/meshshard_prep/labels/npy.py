"""The form "npy": a NumPy array of whole numbers, (L,) or (L,1). Its header is not evaluated, only looked at."""

import re

import numpy as np

from meshshard_prep.labels.written import Written, bad_label

MAGIC = b"\x93NUMPY"
_TYPE = re.compile(rb"'descr': *'([<>|=]?(?:[iu][1248]|f[48]))'")
_SHAPE = re.compile(rb"'shape': *\(([0-9]{1,18}),(?: *1,?)? *\)")


def read_npy(data: bytes, _name: str, place: str) -> Written:
    """Label i is at index i; InvalidMesh where the file holds anything but one array of integers in one column."""
    advice = "store it with numpy.save as a one-dimensional array of integers"
    if not data.startswith(MAGIC):
        raise bad_label("a label file of the form npy is a NumPy array", f"it begins {data[:6]!r}", place, advice)
    start = 10 if data[6:7] == b"\x01" else 12
    end = start + int.from_bytes(data[8:start], "little")
    header = data[start:end]
    kind, shape = _TYPE.search(header), _SHAPE.search(header)
    if kind is None or shape is None:
        found = header.decode("latin-1").strip()
        raise bad_label("labels are an array of integers in one column", f"it is {found[:80]!r}", place, advice)
    dtype, count = np.dtype(kind[1].decode()), int(shape[1])
    if len(data) - end != count * dtype.itemsize:
        found = f"{len(data) - end} follow"
        raise bad_label(f"the array's {count} labels take {count * dtype.itemsize} bytes", found, place, advice)
    values = np.frombuffer(data, dtype, offset=end)
    if dtype.kind == "f":
        odd = np.flatnonzero(~(np.abs(values) < 2**24) | (values != np.rint(values)))
        if len(odd):
            where = f"{place}, index {odd[0]}"
            raise bad_label("labels are whole numbers", f"this one is {float(values[odd[0]])!r}", where, advice)
        values = values.astype(np.int64)
    return Written.of_integers(values, lambda i: f"{place}, index {i}")
