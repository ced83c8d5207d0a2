import pytest

from meshshard import UsageError
from meshshard_train.data import steps_of
from meshshard_train.pairs import MOST_PAIRS, evaluated_pairs, pair_sizes, partners, together
from meshshard_train.recipes import paper

NUMBERS = [3, 4, 7, 8, 20]


def test_partners_are_other_meshes_of_the_split_and_change_with_the_epoch():
    drawn = [partners(NUMBERS, seed, epoch) for seed in range(3) for epoch in range(40)]
    for partner in drawn:
        assert list(partner) == NUMBERS
        assert set(partner.values()) <= set(NUMBERS)
        assert all(first != second for first, second in partner.items())
    for first in NUMBERS:  # each other one about as often: 30 of 120, with a deviation of 4.7
        counts = [sum(partner[first] == other for partner in drawn) for other in NUMBERS if other != first]
        assert min(counts) > 10
    assert partners(NUMBERS, 1, 2) == partners(NUMBERS, 1, 2) != partners(NUMBERS, 1, 3)


def test_every_mesh_is_first_once_an_epoch_and_pairs_fill_the_budget():
    config = paper("correspondence", batch_vertices=100, seed=5)
    sizes = [10 * (number % 4 + 1) for number in range(21)]
    steps = steps_of(NUMBERS, sizes, config, 2)
    assert sorted(first for step in steps for first in step) == NUMBERS
    together_ = pair_sizes(NUMBERS, sizes, 5, 2)
    assert together_ == {a: sizes[a] + sizes[b] for a, b in partners(NUMBERS, 5, 2).items()}
    assert all(sum(together_[first] for first in step) <= 100 or len(step) == 1 for step in steps)
    assert len(steps) > 1


def test_a_mesh_of_several_pairs_is_packed_once():
    numbers, pairs = together([3, 7, 8], {3: 7, 7: 20, 8: 7, 20: 3})
    assert numbers == [3, 7, 8, 20]
    assert [(numbers[a], numbers[b]) for a, b in pairs] == [(3, 7), (7, 20), (8, 7)]
    assert together([], {3: 7}) == ([], ())


def test_all_ordered_pairs_are_evaluated_up_to_a_number():
    assert evaluated_pairs([1, 2, 3]) == {1: [2, 3], 2: [1, 3], 3: [1, 2]}
    many = evaluated_pairs(range(30))
    drawn = {(first, second) for first, seconds in many.items() for second in seconds}
    assert len(drawn) == MOST_PAIRS
    assert all(first != second for first, second in drawn)
    assert many == evaluated_pairs(range(30))


def test_one_mesh_is_no_pair():
    for draw in (lambda: partners([3], 0, 0), lambda: evaluated_pairs([3])):
        with pytest.raises(UsageError, match="correspondence is between two meshes, and there is 1 to"):
            draw()
