"""Some tests have a short form, in `make test`, and a long one, in `make soak`."""

import os

SOAKING = "MESHSHARD_SOAK" in os.environ


def times(short: int, long: int) -> int:
    """How often a fault is tried: `short` in `make test`, `long` in `make soak`."""
    return long if SOAKING else short
