"""A recipe that takes next to no time, for tests of what is around the features."""

from dataclasses import replace

from meshshard.recipe import RECIPES

LIGHT = replace(RECIPES["paper"], name="light", times=(0.1, 1.0), hks_tolerance=1e-2)
