from collections import Counter

import pytest

from meshshard_prep.minicoseg.classes import FAMILIES
from meshshard_prep.minicoseg.layout import SPLITS, split_and_defect


@pytest.mark.parametrize("seed", [0, 1, 12345])
@pytest.mark.parametrize("family", FAMILIES)
def test_thirty_of_a_family_are_twenty_four_and_six(seed, family):
    for start in (0, 30):
        splits = Counter(split_and_defect(seed, family, index)[0] for index in range(start, start + 30))
        assert splits == {"train": 20, "val": 4, "test": 6}


@pytest.mark.parametrize("seed", [0, 1, 12345])
def test_every_split_has_every_defect_once(seed):
    places = [split_and_defect(seed, family, index) for family in FAMILIES for index in range(30)]
    damaged = Counter(place for place in places if place[1])
    assert damaged == {(split, defect): 1 for split in SPLITS for defect in ("open", "nonmanifold", "pieces")}


@pytest.mark.parametrize("family", FAMILIES)
def test_every_family_has_every_defect_once(family):
    assert Counter(split_and_defect(0, family, index)[1] for index in range(30)) == {
        "": 27,
        "open": 1,
        "nonmanifold": 1,
        "pieces": 1,
    }


@pytest.mark.parametrize("family", FAMILIES)
def test_the_first_three_are_sound_and_of_different_splits(family):
    first = [split_and_defect(7, family, index) for index in range(3)]
    assert {split for split, _ in first} == set(SPLITS)
    assert {defect for _, defect in first} == {""}


def test_the_seed_decides():
    chairs = [[split_and_defect(seed, "chair", index) for index in range(30)] for seed in (0, 0, 1)]
    assert chairs[0] == chairs[1] != chairs[2]
