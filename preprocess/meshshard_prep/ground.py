"""What a worker must have in common with the run it works for: the output folder, and what the numbers come from."""

import secrets
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from meshshard.errors import UsageError
from meshshard.files import TEMPORARY_PREFIX
from meshshard.recipe import Recipe
from meshshard_prep import staging

PACKAGES = ("meshshard", "numpy", "scipy", "libigl", "robust-laplacian", "numba", "pymetis")
"""What the numbers of a sample come from; those of a simplified mesh also from SIMPLIFIER."""

SIMPLIFIER = "pymeshlab"


@dataclass(frozen=True)
class Ground:
    """`mark`: a file in the output folder that this run alone has made. `versions`: of what the numbers come from."""

    mark: Path
    versions: tuple[tuple[str, str], ...]


@contextmanager
def common_ground(out: Path, recipe: Recipe) -> Iterator[Ground]:
    """The ground of a run that writes to `out`, whose staging folder is there."""
    mark = out.resolve() / staging.FOLDER / f"{TEMPORARY_PREFIX}{secrets.token_hex(8)}"
    mark.touch()
    try:
        packages = (*PACKAGES, SIMPLIFIER) if recipe.simplify else PACKAGES
        yield Ground(mark, tuple((package, _version(package)) for package in packages))
    finally:
        mark.unlink(missing_ok=True)


@lru_cache(maxsize=1)  # once a worker and run
def check_ground(ground: Ground) -> None:
    """UsageError: this process sees another folder than the run, or has other versions."""
    host = socket.gethostname()
    for package, there in ground.versions:
        here = _version(package)
        if here != there:
            raise UsageError(
                f"the worker on {host} has {package} {here} and this run {there}, so its samples could differ; "
                "install the same there: `pip freeze > versions.txt` here, `pip install -r versions.txt` there"
            )
    if not ground.mark.exists():
        raise UsageError(
            f"the worker on {host} does not see what this run wrote to {ground.mark.parent.parent}; give an --out on "
            "a file system that all machines share, with the same path on each"
        )


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"
