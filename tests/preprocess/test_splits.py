from collections import Counter
from itertools import pairwise
from pathlib import Path

import pytest

from meshshard.splits import Member, draw_folds, draw_fractions, draw_per_class, few_shot
from meshshard_prep import splits as of_data_sets
from meshshard_prep.datasets.layout import Entry, RawDataset

MEMBERS = [Member(f"{i:03}", i % 5) for i in range(100)]
IN_GROUPS = [Member(f"{i:03}", group=f"g{i // 7}") for i in range(100)]


def groups_are_whole(found):
    return len({(member.group, found[member.id]) for member in IN_GROUPS}) == len({m.group for m in IN_GROUPS})


def assign_splits(entries, **settings):
    dataset = RawDataset(name="x", task="unlabelled", classes=(), entries=tuple(entries))
    return of_data_sets.assign_splits(dataset, **settings)


def entry(number, split="train", group="", label=-1):
    name = f"{number:03}"
    return Entry(id=name, path=Path(name), source=name, split=split, group=group, mesh_label=label)


GROUPED = [entry(i, group=f"g{i // 7}") for i in range(100)] + [entry(200 + i, "test", "t") for i in range(9)]


def test_groups_stay_together():
    splits = assign_splits(GROUPED, fraction=0.2, seed=0)
    for group in {e.group for e in GROUPED}:
        assert len({splits[e.id] for e in GROUPED if e.group == group}) == 1
    count = Counter(splits.values())
    assert count["test"] == 9
    assert 14 <= count["val"] <= 20


def test_classes_keep_their_share():
    entries = [entry(i, label=i % 5) for i in range(100)]
    splits = assign_splits(entries, fraction=0.15, seed=1)
    assert Counter(e.mesh_label for e in entries if splits[e.id] == "val") == dict.fromkeys(range(5), 3)


@pytest.mark.parametrize("entries", [GROUPED, [entry(i, label=i % 3) for i in range(60)]])
def test_depends_on_the_seed_and_not_on_the_order(entries):
    first = assign_splits(entries, fraction=0.2, seed=0)
    assert assign_splits(entries[::-1], fraction=0.2, seed=0) == first
    assert any(assign_splits(entries, fraction=0.2, seed=seed) != first for seed in range(1, 4))


def test_validation_is_never_empty_where_it_can_be_drawn():
    small = [entry(i, label=i % 10) for i in range(30)]
    assert Counter(assign_splits(small, fraction=0.15, seed=0).values()) == {"train": 26, "val": 4}
    large = [entry(i, group=f"g{i % 5}") for i in range(100)]
    assert Counter(assign_splits(large, fraction=0.1, seed=0).values()) == {"train": 80, "val": 20}
    two = [entry(0), entry(1)]
    assert Counter(assign_splits(two, fraction=0.1, seed=0).values()) == {"train": 1, "val": 1}
    assert assign_splits(two[:1], fraction=0.1, seed=0) == {"000": "train"}


def test_what_is_shipped_stays():
    shipped = [entry(1), entry(2, "val"), entry(3, "test"), entry(4, "")]
    assert assign_splits(shipped, fraction=0.5, seed=0) == {"001": "train", "002": "val", "003": "test", "004": ""}
    unsplit = [entry(i, "") for i in range(9)]
    assert set(assign_splits(unsplit, fraction=0.5, seed=0).values()) == {""}
    assert set(assign_splits(GROUPED, fraction=0.0, seed=0).values()) == {"train", "test"}


def test_drawn_splits_take_the_place_of_the_shipped():
    entries = tuple(entry(i, "test") for i in range(4))
    drawn = {"000": "train", "001": "val", "002": "test", "003": ""}
    dataset = RawDataset(name="x", task="unlabelled", classes=(), entries=entries, drawn=drawn)
    assert of_data_sets.assign_splits(dataset, fraction=0.5, seed=0) == drawn


def test_a_share_of_train_is_drawn_after_validation():
    entries = [entry(i, label=i % 5) for i in range(100)] + [entry(100 + i, "test") for i in range(9)]
    whole = assign_splits(entries, fraction=0.2, seed=3)
    few = assign_splits(entries, fraction=0.2, seed=3, train_fraction=0.1)
    assert Counter(few.values()) == {"": 72, "val": 20, "test": 9, "train": 8}
    assert {name for name in few if few[name] != whole[name]} == {name for name in few if few[name] == ""}


def test_fractions_keep_shares_of_classes_and_whole_groups():
    fractions = {"test": 0.2, "val": 0.1, "train": 0.7}
    splits = draw_fractions(MEMBERS, fractions, 0)
    for split, share in fractions.items():
        labels = Counter(member.label for member in MEMBERS if splits[member.id] == split)
        assert labels == dict.fromkeys(range(5), round(20 * share))
    splits = draw_fractions(IN_GROUPS, fractions, 0)
    assert groups_are_whole(splits)
    assert 13 <= Counter(splits.values())["test"] <= 20
    assert draw_fractions(IN_GROUPS, {"test": 0.0, "train": 1.0}, 0) == dict.fromkeys(splits, "train")


def test_a_number_of_each_class():
    splits = draw_per_class(MEMBERS, 16, 1)
    assert Counter((member.label, splits[member.id]) for member in MEMBERS) == {
        (label, split): count for label in range(5) for split, count in (("train", 16), ("test", 4))
    }


@pytest.mark.parametrize("folds", [2, 3, 5, 7])
def test_folds_are_even_and_stratified(folds):
    found = draw_folds(MEMBERS, folds, 0)
    sizes = Counter(found.values())
    assert sorted(sizes) == list(range(folds))
    assert max(sizes.values()) - min(sizes.values()) <= 1
    for label in range(5):
        shares = Counter(found[member.id] for member in MEMBERS if member.label == label)
        assert max(shares.values()) - min(shares.values()) <= 1


def test_folds_keep_groups_whole():
    found = draw_folds(IN_GROUPS, 4, 0)
    assert groups_are_whole(found)
    sizes = Counter(found.values())
    assert max(sizes.values()) - min(sizes.values()) <= 7


@pytest.mark.parametrize("seed", range(5))
def test_few_shot_subsets_are_nested_and_stratified(seed):
    subsets = [few_shot(MEMBERS, fraction, seed) for fraction in (1.0, 0.5, 0.1, 0.05, 0.01)]
    assert [len(subset) for subset in subsets] == [100, 50, 10, 5, 1]
    for larger, smaller in pairwise(subsets):
        assert smaller < larger
    for subset, share in zip(subsets, (20, 10, 2, 1), strict=False):
        assert Counter(m.label for m in MEMBERS if m.id in subset) == dict.fromkeys(range(5), share)


@pytest.mark.parametrize(
    "draw",
    [
        lambda members, seed: draw_fractions(members, {"test": 0.3, "train": 0.7}, seed),
        lambda members, seed: draw_per_class(members, 3, seed),
        lambda members, seed: draw_folds(members, 4, seed),
        lambda members, seed: few_shot(members, 0.2, seed),
    ],
)
@pytest.mark.parametrize("members", [MEMBERS, IN_GROUPS], ids=["classes", "groups"])
def test_draws_depend_on_the_seed_and_not_on_the_order(draw, members):
    assert draw(members[::-1], 0) == draw(members, 0)
    assert any(draw(members, seed) != draw(members, 0) for seed in range(1, 4))


@pytest.mark.parametrize(
    ("fractions", "counts"),
    [
        ({"test": 1.0, "val": 0.0, "train": 0.0}, {"test": 100}),
        ({"test": 0.5, "val": 0.5, "train": 0.0}, {"test": 50, "val": 50}),
        ({"test": 0.999, "train": 0.001}, {"test": 99, "train": 1}),
        ({"test": 0.0, "val": 0.0, "train": 1.0}, {"train": 100}),
    ],
)
@pytest.mark.parametrize("members", [MEMBERS, [Member(f"{i:03}") for i in range(100)]], ids=["classes", "plain"])
def test_shares_of_nothing_and_of_all(fractions, counts, members):
    assert Counter(draw_fractions(members, fractions, 0).values()) == counts
