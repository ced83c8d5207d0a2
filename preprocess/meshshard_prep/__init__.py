"""The offline half of meshshard: raw meshes in, feature shards out.

`compute_features` is the way of one mesh for use from Python; `run.py` is the way of all meshes of a data set.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from meshshard_prep.pipeline import compute_features

__all__ = ["compute_features"]


def __getattr__(name: str) -> Any:
    """`compute_features`, imported at first use: scipy and libigl stay out of a command that only prints help."""
    if name == "compute_features":
        from meshshard_prep.pipeline import compute_features

        return compute_features
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
