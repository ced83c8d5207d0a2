"""Colours of classes: told apart by people with colour-blind eyes."""

import numpy as np
from jaxtyping import Int, UInt8

# Okabe and Ito 2008, then Tol's muted scheme for more
COLOURS = (
    *("#0072B2", "#E69F00", "#009E73", "#D55E00", "#56B4E9", "#CC79A7", "#F0E442"),
    *("#332288", "#882255", "#999933", "#44AA99", "#AA4499"),
)
UNLABELLED = "#BBBBBB"


def class_colour(number: int) -> str:
    """Hexadecimal colour of a class, grey for -1. After twelve they start again."""
    return UNLABELLED if number < 0 else COLOURS[number % len(COLOURS)]


def colours_of(labels: Int[np.ndarray, " n"]) -> UInt8[np.ndarray, "n 3"]:
    """Red, green and blue of each label."""
    table = [bytes.fromhex(class_colour(number)[1:]) for number in range(-1, int(labels.max(initial=-1)) + 1)]
    return np.frombuffer(b"".join(table), dtype=np.uint8).reshape(-1, 3)[labels + 1]
