"""Settings of a run from a recipe, a TOML file and the command line, the later over the earlier."""

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

from meshshard.errors import UsageError
from meshshard_train.config import TrainConfig
from meshshard_train.recipes import RECIPES

FIXED = ("recipe", "task")
"""Settings that follow from the recipe's name and the data set."""


def resolved(
    recipe: str, task: str, file: Path | None, assignments: Sequence[str], named: Mapping[str, Any]
) -> TrainConfig:
    """The configuration of a recipe with overrides. `assignments`: NAME=VALUE; `named`: None is not given.

    UsageError: no such recipe or setting, or a value of another kind, with the place where it stands.
    """
    if recipe not in RECIPES:
        raise UsageError(f"no training recipe is called {recipe!r}; there are {', '.join(RECIPES)}")
    overrides = _of_file(file) if file else {}
    for text in assignments:
        name, sign, value = text.partition("=")
        if not sign:
            raise UsageError(f"--set {text}: it is written NAME=VALUE, as --set ema=0.999")
        overrides[name.strip()] = _value(name.strip(), value.strip(), "--set")
    overrides |= {name: _value(name, value, "") for name, value in named.items() if value is not None}
    return RECIPES[recipe](task, **overrides)


def _of_file(path: Path) -> dict[str, Any]:
    try:
        table = tomllib.loads(path.read_text())
    except FileNotFoundError:
        raise UsageError(f"{path}: no such file") from None
    except (OSError, ValueError, RecursionError) as error:
        raise UsageError(f"{path} is no TOML file that can be read: {error}") from error
    return {name: _value(name, value, str(path)) for name, value in table.items()}


def _value(name: str, value: Any, place: str) -> Any:
    """A value in the type of its setting; text is read."""
    types = {f.name: f.type for f in fields(TrainConfig) if f.name not in FIXED}
    where = f"{place}: " if place else ""
    if name not in types:
        if name in FIXED:
            raise UsageError(f"{where}{name} is no setting: it follows from --recipe and the data set")
        raise UsageError(f"{where}no training setting is called {name!r}; there are {', '.join(types)}")
    kind = types[name]
    if name == "features":
        names = value.split(",") if isinstance(value, str) else value
        if not isinstance(names, list | tuple) or not all(isinstance(one, str) for one in names):
            raise UsageError(f'{where}features is a list of texts, as ["vertices", "hks"], not {value!r}')
        return tuple(one.strip() for one in names)
    if name == "rotation_axes" and value == "none":
        return ""
    assert isinstance(kind, type)
    if isinstance(value, str) and kind is not str:
        try:
            if kind is bool:
                return {"true": True, "false": False}[value.lower()]
            return _number(value) if kind is float else kind(value)
        except (KeyError, ValueError, ZeroDivisionError):
            raise UsageError(f"{where}{name} is {WORDS[kind]}, not {value!r}") from None
    if kind is float and type(value) is int and abs(value) < 2**63:
        return float(value)
    if type(value) is not kind:
        raise UsageError(f"{where}{name} is {WORDS[kind]}, not {value!r}")
    return value


def _number(text: str) -> float:
    """Of text such as 0.1, 1e-3 or 1/100."""
    above, _, below = text.partition("/")
    return float(above) / float(below or 1)


WORDS = {bool: "true or false", int: "a whole number", float: "a number", str: "a text"}
