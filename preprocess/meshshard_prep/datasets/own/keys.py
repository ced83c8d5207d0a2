"""The keys that a data set's TOML file may have, and what each may be."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from meshshard_prep.datasets.layout import DOMAINS
from meshshard_prep.labels import FORMS

LAYOUTS = ("folder", "meshcnn-segmentation", "meshcnn-classification")


@dataclass(frozen=True, kw_only=True)
class Key:
    """`words` say what a value is; `fits` tells whether one is that; `choices` are all there are, or none."""

    words: str
    fits: Callable[[Any], bool]
    choices: tuple[str, ...] = ()


def _is_text(value: Any) -> bool:
    return isinstance(value, str)


def _is_texts(value: Any) -> bool:
    return isinstance(value, list) and all(map(_is_text, value))


def _is_whole(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _is_label(value: Any) -> bool:
    return _is_text(value) or _is_whole(value)


def _is_labels(value: Any) -> bool:
    return _is_label(value) or (isinstance(value, list) and all(map(_is_label, value)))


def _is_share(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and 0 <= value <= 1


def _is_table_of(fits: Callable[[Any], bool]) -> Callable[[Any], bool]:
    return lambda value: isinstance(value, dict) and all(map(fits, value.values()))


_TEXT = Key(words="a text in quotes", fits=_is_text)
_TEXTS = Key(words="a text in quotes or a list of them", fits=lambda value: _is_text(value) or _is_texts(value))
_CLASSES = _is_table_of(_is_labels)


def _one_of(*choices: str) -> Key:
    return Key(words=f"one of {', '.join(choices)}", fits=lambda value: value in choices, choices=choices)


KEYS = {
    "name": _TEXT,
    "raw": _TEXT,
    "meshes": _TEXTS,
    "layout": _one_of(*LAYOUTS),
    "licence": _TEXT,
    "citation": _TEXT,
    "classes": Key(
        words="a list of names, or a table of name = label, or such a table for each folder",
        fits=lambda value: _is_texts(value) or _CLASSES(value) or _is_table_of(_CLASSES)(value),
    ),
    "colours": Key(words="a table of name = colour", fits=_is_table_of(_is_text)),
    "labels.files": _TEXT,
    "labels.form": _one_of(*FORMS),
    "labels.name": _TEXT,
    "labels.domain": _one_of(*DOMAINS),
    "labels.to": _one_of("face", "vertex"),
    "labels.unlabelled": Key(words="a label or a list of labels", fits=_is_labels),
    "labels.mesh": _TEXT,
    "splits.train": _TEXTS,
    "splits.val": _TEXTS,
    "splits.test": _TEXTS,
    "splits.fractions": Key(
        words="a table of train, val and test = numbers from 0 to 1", fits=_is_table_of(_is_share)
    ),
    "splits.folds": Key(words="a whole number, 2 or more", fits=lambda value: _is_whole(value) and value >= 2),
    "splits.group": _TEXT,
}
"""Every key, those in a table after its name. docs/datasets.md is held to it."""

SECTIONS = tuple(dict.fromkeys(name.split(".")[0] for name in KEYS if "." in name))
"""The tables that keys are in."""
