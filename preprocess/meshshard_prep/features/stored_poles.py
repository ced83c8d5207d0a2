"""Rational sums that are kept: those of the named recipes in the package, others in the user's cache folder.

`python -m meshshard_prep.features.stored_poles` writes the package's anew.
"""

import contextlib
import io
from functools import lru_cache
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np
import platformdirs

from meshshard.files import publish, sha256_of
from meshshard.recipe import RECIPES
from meshshard_prep.features.rational import RationalExponential, fit_exponential

COUNTS = (8, 16, 24, 32)
"""Numbers of poles to choose from. They are worked on eight at a time, so fewer would cost as much."""

PACKAGE = Path(__file__).with_name("poles")

VERSION = 1
"""Raised whenever `fit_exponential` gives other numbers."""

_ARRAYS = ("poles", "weights", "majorants", "uniform_error", "error")


@lru_cache
def rational_exponential(times: tuple[float, ...], count: int) -> RationalExponential:
    """The sum with `count` poles for these times: from the package, from the cache, or computed and cached.

    A cache that cannot be read or written costs these seconds in every process, and no more.
    """
    cached = cache_folder() / _file_name(times, count)
    for path in (PACKAGE / cached.name, cached):
        absent_or_damaged = contextlib.suppress(OSError, EOFError, KeyError, ValueError, BadZipFile)
        with absent_or_damaged, np.load(io.BytesIO(path.read_bytes()), allow_pickle=False) as file:
            return RationalExponential(**{name: file[name][()] for name in _ARRAYS})
    found = fit_exponential(np.array(times), count)
    with contextlib.suppress(OSError):
        cached.parent.mkdir(parents=True, exist_ok=True)
        publish(cached, _as_file(found))
    return found


def cache_folder() -> Path:
    """Where sums for other times are kept, by the system's custom: ~/.cache/meshshard on Linux."""
    return Path(platformdirs.user_cache_dir("meshshard", appauthor=False))


def _file_name(times: tuple[float, ...], count: int) -> str:
    return f"v{VERSION}-{sha256_of(repr(times).encode())[:16]}-{count}.npz"


def _as_file(found: RationalExponential) -> bytes:
    file = io.BytesIO()
    arrays: dict[str, Any] = {name: getattr(found, name) for name in _ARRAYS}
    np.savez(file, **arrays)
    return file.getvalue()


if __name__ == "__main__":
    PACKAGE.mkdir(exist_ok=True)
    for times in {recipe.times for recipe in RECIPES.values()}:
        for count in COUNTS:
            found = fit_exponential(np.array(times), count)
            publish(PACKAGE / _file_name(times, count), _as_file(found))
            print(
                f"{len(times)} times, {len(found.poles)} poles: {found.uniform_error:.1e} uniform, {found.error:.1e}"
            )
