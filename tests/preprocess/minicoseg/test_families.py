"""What is drawn, before it is meshed."""

from collections import Counter

import numpy as np
import pytest

from meshshard_prep.minicoseg.aliens import draw_alien
from meshshard_prep.minicoseg.chairs import draw_chair
from meshshard_prep.minicoseg.classes import CLASSES
from meshshard_prep.minicoseg.vases import draw_vase

FAMILIES = {"chair": draw_chair, "vase": draw_vase, "alien": draw_alien}
DRAWS = 150


def drawn(family, seed):
    return FAMILIES[family](np.random.default_rng(seed))


def classes(family):
    """How many of the draws have each class, as a share."""
    seen = Counter(CLASSES[i] for seed in range(DRAWS) for i in {p.label for p in drawn(family, seed).parts})
    return {name: count / DRAWS for name, count in seen.items()}


def test_classes_of_chairs():
    shares = classes("chair")
    assert set(shares) == {"chair back", "chair seat", "chair legs"}
    assert shares["chair seat"] == shares["chair legs"] == 1
    assert 0.8 < shares["chair back"] < 1  # stools have none


def test_classes_of_vases():
    shares = classes("vase")
    assert set(shares) == {"vase base", "vase body", "vase neck", "vase handle"}
    assert shares["vase base"] == shares["vase body"] == shares["vase neck"] == 1
    assert 0.55 < shares["vase handle"] < 0.8


def test_classes_of_aliens():
    assert classes("alien") == {"alien head": 1, "alien body": 1, "alien limbs": 1}


@pytest.mark.parametrize("family", FAMILIES)
def test_shapes_stand_on_the_floor_and_are_about_one_unit_tall(family):
    lattice = np.stack(np.meshgrid(*[np.linspace(-0.8, 1.6, 41)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    for seed in range(3):
        inside = lattice[drawn(family, seed).value(lattice) < 0]
        assert -0.05 < inside[:, 1].min() < 0.1
        assert 0.35 < np.ptp(inside[:, 1]) < 1.5
        assert np.abs(inside[:, [0, 2]]).max() < 0.75


@pytest.mark.parametrize("family", FAMILIES)
def test_draws_differ(family):
    points = np.random.default_rng(0).uniform([-0.4, 0, -0.4], [0.4, 1, 0.4], size=(200, 3))
    values = [drawn(family, seed).value(points) for seed in range(10)]
    assert all(np.abs(one - two).max() > 0.02 for i, one in enumerate(values) for two in values[:i])


def test_some_vases_are_hollow_at_the_mouth_and_have_walls():
    hollow = 0
    for seed in range(40):
        neck = next(part for part in drawn("vase", seed).parts if part.label == CLASSES.index("vase neck"))
        axis = np.column_stack([np.zeros(300), np.linspace(0, 1.2, 300), np.zeros(300)])
        height = axis[:, 1]
        lip = np.stack(np.meshgrid(np.linspace(0, 0.5, 60), height, 0.0, indexing="ij"), axis=-1).reshape(-1, 3)
        rim = lip[neck.distance(lip) < 0, 1].max()
        solid = height[neck.distance(axis) < 0].max()
        hollow += rim - solid > 0.05
        assert rim - solid < 0.3  # a bottom is left
    assert 5 < hollow < 35
