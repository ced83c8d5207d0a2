"""What the rows of an element of a PLY are read into: a column for each property."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Int64, Shaped

from meshshard_prep.formats.ply_header import BYTES, INTEGERS


@dataclass(frozen=True, eq=False, kw_only=True)
class Lists:
    """A column of lists, one after the other in `values`: that of row i has the next `lengths[i]` of them.

    Lengths are read without a sign, whatever their type, so that none is negative.
    """

    lengths: Int64[np.ndarray, " R"]
    values: Shaped[np.ndarray, " N"]


Column = np.ndarray | Lists


def type_of(name: str, order: str = "=", signed: bool = True) -> np.dtype:
    """The type that a PLY calls so, in the byte order "<", ">" or "="; a length is read without its sign."""
    kind = "f" if name not in INTEGERS else "u" if name.startswith("u") or not signed else "i"
    return np.dtype(f"{order}{kind}{BYTES[name]}")


def spread(
    starts: Int64[np.ndarray, " R"], lengths: Int64[np.ndarray, " R"], step: int = 1
) -> Int64[np.ndarray, " N"]:
    """Where the values of lists are that start there: `lengths[i]` positions from `starts[i]` on, `step` apart."""
    before = np.cumsum(lengths) - lengths
    return np.repeat(starts - step * before, lengths) + step * np.arange(lengths.sum())
