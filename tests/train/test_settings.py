"""Settings from a recipe, a file and the command line."""

import pytest

from meshshard import UsageError
from meshshard_train.recipes import official
from meshshard_train.settings import resolved


def test_the_later_wins(tmp_path):
    file = tmp_path / "my.toml"
    file.write_text('epochs = 7\nema = 0.5\nfeatures = ["hks", "dihedral"]\nlearning_rate = 1\n')
    config = resolved("paper", "segmentation", file, ["ema=0.25", "clip_norm = 1/2"], {"epochs": 9, "seed": None})
    assert (config.epochs, config.ema, config.clip_norm, config.seed, config.learning_rate) == (9, 0.25, 0.5, 0, 1.0)
    assert config.features == ("hks", "dihedral")
    named = resolved("official", "segmentation", None, ["votes_itself=true"], {"features": "vertices, hks"})
    assert (named.features, named.votes_itself, official("segmentation").votes_itself) == (
        ("vertices", "hks"),
        True,
        False,
    )


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("features = 3", r"my.toml: features is a list of texts, .* not 3"),
        ('features = [["a"]]', "features is a list of texts"),
        ('features = ["hks", "hks"]', "each once"),
        ("learning_rate = inf", "learning_rate is above 0, not inf"),
        ("seed = 9223372036854775808", r"seed is 0 or more, and below 2\^63"),
        ('epochs = "x"', "epochs is a whole number, not 'x'"),
        ("epochs = 1.5", "epochs is a whole number, not 1.5"),
        ("votes_itself = 1", "votes_itself is true or false, not 1"),
        ("task = 1", "my.toml: task is no setting: it follows from --recipe and the data set"),
        ("colour = 1", "my.toml: no training setting is called 'colour'"),
        (f"learning_rate = {10**400}", "learning_rate is a number, not 1000"),
        ("epochs = ", "is no TOML file that can be read"),
    ],
)
def test_mistakes_in_a_file_are_told(tmp_path, text, message):
    (tmp_path / "my.toml").write_text(text)
    with pytest.raises(UsageError, match=message):
        resolved("paper", "segmentation", tmp_path / "my.toml", [], {})


@pytest.mark.parametrize(
    ("assignment", "message"),
    [
        ("ema", "--set ema: it is written NAME=VALUE"),
        ("warmup_epochs=1e400", "warmup_epochs is 0 or more, not inf"),
        ("warmup_epochs=many", "warmup_epochs is a number, not 'many'"),
        ("ema=1/0", "ema is a number, not '1/0'"),
        ("votes_itself=maybe", "votes_itself is true or false, not 'maybe'"),
        ("colour=red", "--set: no training setting is called 'colour'"),
    ],
)
def test_mistakes_on_the_command_line_are_told(assignment, message):
    with pytest.raises(UsageError, match=message):
        resolved("paper", "segmentation", None, [assignment], {})


def test_recipes_that_are_not_there():
    with pytest.raises(
        UsageError, match="no training recipe is called 'ours'; there are paper, official, fast, best"
    ):
        resolved("ours", "segmentation", None, [], {})
    with pytest.raises(UsageError, match="there is no recipe official for correspondence"):
        resolved("official", "correspondence", None, [], {})
