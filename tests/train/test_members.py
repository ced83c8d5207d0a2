from collections import Counter
from dataclasses import replace
from itertools import pairwise

import pytest
from samples import sample, write_dataset

from meshshard import UsageError, open_dataset
from meshshard_train.members import classes_without, training_numbers
from meshshard_train.recipes import official, paper
from meshshard_train.settings import resolved

FRACTIONS = (1.0, 1 / 2, 1 / 10, 1 / 50, 1 / 100)
SPLITS = ["train"] * 100 + ["val"] * 10 + ["test"] * 10
SIZES = (50, 30, 20)
"""Training meshes of each class, or group."""
STRATA = [name for name, size in enumerate(SIZES) for _ in range(size)] + [0] * 20


@pytest.fixture(scope="module", params=["classification", "segmentation"])
def world(request, tmp_path_factory):
    """A data set of meshes with a class, or of groups of meshes whose faces have classes."""
    task = request.param
    samples = []
    for number, stratum in enumerate(STRATA):
        if task == "classification":
            what = {"labels": None, "mesh_label": stratum, "label_domain": "mesh"}
        else:
            what = {"group": f"group {stratum}"}
        samples.append(sample(number, level=0, **what))
    return open_dataset(write_dataset(tmp_path_factory.mktemp(task) / "data", samples, SPLITS, task=task)), task


def subset(world, fraction, seed=0, recipe=paper):
    return training_numbers(world[0], replace(recipe(world[1], seed=seed), train_fraction=fraction))


@pytest.mark.parametrize("seed", range(3))
def test_few_shot_subsets_are_nested_and_stratified(world, seed):
    subsets = [subset(world, fraction, seed) for fraction in FRACTIONS]
    assert [len(numbers) for numbers in subsets] == [100, 50, 10, 2, 1]
    for larger, smaller in pairwise(subsets):
        assert set(smaller) < set(larger)
    for numbers, share in zip(subsets[:3], (1, 2, 10), strict=True):
        shares = Counter(STRATA[number] for number in numbers)
        assert [shares[name] for name in range(3)] == [size // share for size in SIZES]


def test_few_shot_learns_from_train_alone_and_the_seed_decides(world):
    draws = [tuple(subset(world, 0.1, seed)) for seed in range(5)]
    assert len(set(draws)) == 5
    assert draws[0] == tuple(subset(world, 0.1, 0))
    assert all(world[0].index.splits[number] == "train" for draw in draws for number in draw)
    assert {name: len(members) for name, members in world[0].splits.items()} == {"train": 100, "val": 10, "test": 10}


@pytest.mark.parametrize("fraction", [1.0, 0.5, 0.1])
def test_deformed_copies_come_with_their_originals(tmp_path, fraction):
    names = [f"m{number}" for number in range(20)] + [f"m{n}~deformed{k}" for n in range(20) for k in (1, 2)]
    samples = [replace(sample(number, level=0), id=name) for number, name in enumerate(names)]
    dataset = open_dataset(write_dataset(tmp_path, samples, ["train"] * 60))
    found = training_numbers(dataset, paper("segmentation", train_fraction=fraction))
    assert Counter(Counter(dataset.ids[number].partition("~")[0] for number in found).values()) == {3: 20 * fraction}


def test_where_test_chooses_validation_is_trained_on_and_test_never(world):
    assert Counter(world[0].index.splits[n] for n in subset(world, 1.0, recipe=official)) == {"train": 100, "val": 10}
    assert all(world[0].index.splits[n] != "test" for n in subset(world, 0.5, recipe=official))
    assert len(subset(world, 0.1, recipe=official)) == 11


def test_classes_that_no_mesh_has_are_named(world):
    dataset, task = world
    numbers = [number for number in range(100) if task == "segmentation" or STRATA[number] != 1]
    assert classes_without(dataset, numbers, task) == ([] if task == "segmentation" else ["middle"])
    assert classes_without(dataset, [], task) == ["low", "middle", "high"]
    assert classes_without(dataset, [], "correspondence") == []


@pytest.mark.parametrize(("text", "value"), [("0.01", 0.01), ("1/100", 0.01), ("1/3", 1 / 3), ("1", 1.0)])
def test_a_fraction_is_written_either_way(text, value):
    for given in ({"assignments": [f"train_fraction={text}"], "named": {}}, {"assignments": []}):
        named = given.get("named", {"train_fraction": text})
        assert resolved("paper", "segmentation", None, given["assignments"], named).train_fraction == value


@pytest.mark.parametrize("text", ["a tenth", "1/0", "1/2/3", ""])
def test_what_is_no_fraction_is_refused(text):
    with pytest.raises(UsageError, match=f"train_fraction is a number, not {text!r}"):
        resolved("paper", "segmentation", None, [], {"train_fraction": text})


@pytest.mark.parametrize("text", ["0", "2/1", "-1/2", "1.5", "nan"])
def test_a_fraction_is_above_0_and_at_most_1(text):
    with pytest.raises(UsageError, match="train_fraction is above 0 and at most 1, not"):
        resolved("paper", "segmentation", None, [], {"train_fraction": text})
