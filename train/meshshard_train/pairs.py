"""Which meshes are compared: in training each once an epoch as the first of a pair; in evaluation all with all."""

from collections.abc import Mapping, Sequence
from itertools import permutations

import numpy as np

from meshshard import UsageError

MOST_PAIRS = 400
"""Pairs of a split that are evaluated; of more, so many are drawn. The 20 test meshes of FAUST and SCAPE make 380."""


def partners(numbers: Sequence[int], seed: int, epoch: int) -> dict[int, int]:
    """The second mesh of each mesh's pair: another one, by (seed, epoch, number). UsageError: there is none."""
    _check(numbers, "to train with")
    found = {}
    for place, number in enumerate(numbers):
        drawn = int(np.random.default_rng((seed, epoch, number, 1)).integers(len(numbers) - 1))
        found[number] = numbers[drawn + (drawn >= place)]
    return found


def pair_sizes(numbers: Sequence[int], sizes: Sequence[int], seed: int, epoch: int) -> dict[int, int]:
    """Vertices of both meshes of each pair, by the number of its first."""
    return {first: sizes[first] + sizes[second] for first, second in partners(numbers, seed, epoch).items()}


def together(firsts: Sequence[int], partner: Mapping[int, int]) -> tuple[list[int], tuple[tuple[int, int], ...]]:
    """The meshes of some pairs, each once, and the places of each pair among them. A mesh of several pairs is needed
    once: what is drawn for it depends on its number alone."""
    numbers = list(dict.fromkeys([*firsts, *(partner[first] for first in firsts)]))
    place = {number: at for at, number in enumerate(numbers)}
    return numbers, tuple((place[first], place[partner[first]]) for first in firsts)


def evaluated_pairs(numbers: Sequence[int]) -> dict[int, list[int]]:
    """The seconds of each first: all ordered pairs of a split, or MOST_PAIRS of them, the same in every run.
    UsageError: there is none."""
    _check(numbers, "to evaluate")
    every = list(permutations(numbers, 2))
    if len(every) > MOST_PAIRS:
        kept = np.random.default_rng(0).choice(len(every), MOST_PAIRS, replace=False)
        every = [every[place] for place in sorted(kept)]
    found: dict[int, list[int]] = {}
    for first, second in every:
        found.setdefault(first, []).append(second)
    return found


def _check(numbers: Sequence[int], what: str) -> None:
    if len(numbers) < 2:
        raise UsageError(f"correspondence is between two meshes, and there is {len(numbers)} {what}: add meshes")
