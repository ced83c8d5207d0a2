import json

import numpy as np
import pytest

from meshshard.errors import UsageError
from meshshard.recipe import RECIPES, Recipe, find_recipe, log_spaced


def test_times_are_log_spaced():
    np.testing.assert_allclose(RECIPES["paper"].times, np.logspace(-2, 0, 16), rtol=1e-14)
    assert log_spaced(0.5, 2.0, 3) == (0.5, 1.0, 2.0)


@pytest.mark.parametrize("recipe", RECIPES.values(), ids=str)
def test_json_round_trip(recipe, tmp_path):
    assert Recipe.from_json(recipe.to_json()) == recipe
    (tmp_path / "r.json").write_text(recipe.to_json())
    assert find_recipe(str(tmp_path / "r.json")) == recipe
    assert find_recipe(recipe.name) == recipe


def test_an_integer_is_as_good_as_its_float():
    table = json.loads(RECIPES["official"].to_json()) | {"regularisation": 0}
    assert Recipe.from_table(table, "").to_json().count('"regularisation":0.0') == 1


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"laplacian": "graph"}, "laplacian is 'robust' or 'cotangent', not 'graph'"),
        ({"times": []}, "times are numbers from 1e-09"),
        ({"times": [0.0, 1.0]}, "times are numbers from 1e-09"),
        ({"regularisation": -1.0}, "regularisation is 0 or more"),
        ({"hks_tolerance": 1.0}, "hks_tolerance is between 0 and 1"),
        ({"steps": ["smooth"]}, "steps are some of weld, largest_component, orient, each once"),
        ({"steps": ["weld", "weld"]}, "steps are some of weld, largest_component, orient, each once"),
        ({"steps": "weld"}, "steps is a list of names, not 'weld'"),
        ({"simplify": 3}, "simplify is a number of faces, 4 or more, not 3"),
        ({"weld": 1}, "weld is of type bool, not 1"),
        ({"regularisation": True}, "regularisation is of type float, not True"),
        ({"wled": True}, r"unknown recipe settings \['wled'\]"),
    ],
)
def test_nonsense_is_refused(change, message):
    with pytest.raises(UsageError, match=message):
        Recipe.from_table(json.loads(RECIPES["paper"].to_json()) | change, "here")


def test_unknown_names_and_files(tmp_path):
    with pytest.raises(UsageError, match="no recipe is called 'papr'; there are paper, best, official"):
        find_recipe("papr")
    with pytest.raises(UsageError, match="cannot read the recipe"):
        find_recipe(str(tmp_path / "none.json"))
    with pytest.raises(UsageError, match="needs a name"):
        Recipe.from_table({}, "here")
    with pytest.raises(UsageError, match="a recipe is a table"):
        Recipe.from_table([], "here")
