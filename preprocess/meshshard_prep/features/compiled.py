"""Compiled functions whose machine code is kept: beside the package, or in the user's cache folder."""

import inspect
from collections.abc import Callable
from typing import Any

import numba


def compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    """`numba.njit` with a cache where one can be written; without, every process compiles for itself.

    Entries are for one processor and published by renaming, so workers and machines may share a folder.
    """
    plain = inspect.unwrap(function)  # a wrapper that checks argument types cannot be compiled
    try:
        return numba.njit(cache=True, error_model="numpy")(plain)
    except RuntimeError:  # "no locator available": neither folder can be written to
        return numba.njit(error_model="numpy")(plain)
