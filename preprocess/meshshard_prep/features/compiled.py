"""Compiled functions whose machine code is kept: beside the package, or in the user's cache folder."""

import contextlib
import hashlib
import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
from numba.core.caching import FunctionCache

_DIGEST = hashlib.sha256(
    b"".join(path.read_bytes() for path in sorted(Path(__file__).parent.glob("*.py")))
).hexdigest()
"""Of all that compiled functions may call: numba itself looks only at the file that defines a function."""


class _Cache(FunctionCache):
    """Entries are for one processor and one state of the sources, and published by renaming."""

    def _index_key(self, sig: Any, codegen: Any) -> Any:
        return (*super()._index_key(sig, codegen), _DIGEST)  # type: ignore[no-untyped-call]


def compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    """`numba.njit` with a cache where one can be written; without, every process compiles for itself."""
    plain = inspect.unwrap(function)  # a wrapper that checks argument types cannot be compiled
    dispatcher: Any = numba.njit(error_model="numpy")(plain)
    with contextlib.suppress(RuntimeError):  # "no locator available": neither folder can be written to
        dispatcher._cache = _Cache(plain)  # type: ignore[no-untyped-call]
    return dispatcher
