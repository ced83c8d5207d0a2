"""Colours of classes, told apart by people with colour-blind eyes, and of numbers, in even steps of lightness."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float, Int, UInt8

# Okabe and Ito 2008, then three of Tol's muted scheme and two that are far from all before, to eyes of every kind
COLOURS = (
    *("#0072B2", "#E69F00", "#009E73", "#D55E00", "#56B4E9", "#CC79A7", "#F0E442"),
    *("#332288", "#882255", "#999933", "#AAEEAA", "#664422"),
)
UNLABELLED = "#BBBBBB"

# viridis (van der Walt and Smith 2015, CC0) at 17 even places
VIRIDIS = (
    *("#440154", "#48186A", "#472D7B", "#424086", "#3B528B", "#33638D", "#2C728E", "#26828E", "#21918C"),
    *("#1FA088", "#28AE80", "#3FBC73", "#5EC962", "#84D44B", "#ADDC30", "#D8E219", "#FDE725"),
)


def class_colour(number: int, chosen: Sequence[str] = ()) -> str:
    """Hexadecimal colour of a class: of those chosen for a data set, if any, else of the palette, whose twelve start
    again. Grey for -1."""
    colours = chosen or COLOURS
    return UNLABELLED if number < 0 else colours[number % len(colours)]


def colours_of(labels: Int[np.ndarray, "*n"], chosen: Sequence[str] = ()) -> UInt8[np.ndarray, "*n 3"]:
    """Red, green and blue of each label."""
    highest = int(labels.max(initial=-1))
    return _bytes_of([class_colour(number, chosen) for number in range(-1, highest + 1)])[labels + 1]


def colours_between(values: Float[np.ndarray, " n"], lowest: float, highest: float) -> UInt8[np.ndarray, "n 3"]:
    """Red, green and blue of each number: dark violet at `lowest` and below, yellow at `highest` and above. All are
    dark where the two are equal."""
    share = (values - lowest) / (highest - lowest) if highest > lowest else np.zeros_like(values)
    places, anchors = np.linspace(0, 1, len(VIRIDIS)), _bytes_of(VIRIDIS)
    channels = [np.interp(share, places, anchors[:, channel]) for channel in range(3)]
    return np.rint(np.stack(channels, axis=1)).astype(np.uint8)


def _bytes_of(colours: Sequence[str]) -> UInt8[np.ndarray, "n 3"]:
    return np.frombuffer(b"".join(bytes.fromhex(colour[1:]) for colour in colours), dtype=np.uint8).reshape(-1, 3)
