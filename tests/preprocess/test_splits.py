from collections import Counter
from pathlib import Path

import pytest

from meshshard_prep.datasets.layout import Entry
from meshshard_prep.splits import assign_splits


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
