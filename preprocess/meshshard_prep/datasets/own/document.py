"""A TOML file whose keys are known and of the right kind, and which tells every mistake with its line."""

import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from meshshard.errors import UsageError
from meshshard_prep.datasets.own.keys import KEYS, SECTIONS
from meshshard_prep.datasets.own.lines import Key, lines_of_keys


@dataclass(frozen=True, eq=False, kw_only=True)
class Document:
    """`values`: key as KEYS has it -> value. `lines`: path of a key -> its line."""

    path: Path
    values: Mapping[str, Any]
    lines: Mapping[Key, int]

    def __contains__(self, key: str) -> bool:
        return key in self.values

    def get(self, key: str, default: Any = None) -> Any:
        """The value of a key of KEYS, or the default."""
        return self.values.get(key, default)

    def place(self, key: str, *inside: str | int) -> str:
        """File and line of a key, or of a value inside it; of what is not there, those of what it would be in."""
        path = (*key.split("."), *inside)
        while path and path not in self.lines:
            path = path[:-1]
        return f"{self.path}:{self.lines[path]}" if path else str(self.path)

    def wrong(self, key: str, rule: str, *inside: str | int) -> UsageError:
        """The error to raise: `rule` goes on after the key's name."""
        return UsageError(f"{self.place(key, *inside)}: {key} {rule}")


def near(word: str, words: Iterable[str]) -> str:
    """ "; do you mean 'x'?" with the most similar of the words, or nothing."""
    found = get_close_matches(word, words, n=1)
    return f"; do you mean {found[0]!r}?" if found else ""


def read_document(path: Path) -> Document:
    """Read a TOML file. UsageError: no TOML, an unknown key, or a value of another kind; with the line."""
    try:
        text = path.read_text(encoding="utf-8-sig")
        table = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        what, _, place = str(error).partition(" (at ")
        line = place.removeprefix("line ").split(",")[0]  # or "end of document"
        line = line if line.isdigit() else str(len(text.splitlines()))
        raise UsageError(f"{path}:{line}: this is no TOML: {what[0].lower()}{what[1:]}") from error
    except (OSError, ValueError, RecursionError) as error:
        raise UsageError(f"{path} cannot be read: {error}") from error
    document = Document(path=path, values=_flat(table), lines=lines_of_keys(text))
    for key, value in document.values.items():
        if key in SECTIONS:
            raise document.wrong(key, f"is a table: write [{key}], and its keys below")
        if key not in KEYS:
            raise UsageError(
                f"{document.place(key)}: unknown key {key!r}{_nearest(key)}; known are {', '.join(KEYS)}"
            )
        if not KEYS[key].fits(value):
            hint = near(value, KEYS[key].choices) if isinstance(value, str) else ""
            raise document.wrong(key, f"is {KEYS[key].words}, not {value!r}{hint}")
    return document


def _flat(table: Mapping[str, Any]) -> dict[str, Any]:
    """The keys of SECTIONS after the name of their table."""
    flat: dict[str, Any] = {}
    for name, value in table.items():
        if name in SECTIONS and isinstance(value, dict):
            flat |= {f"{name}.{key}": inner for key, inner in value.items()}
        else:
            flat[name] = value
    return flat


def _nearest(key: str) -> str:
    """A key that is known by its last name belongs into a table; else the most similar."""
    last = key.split(".")[-1]
    ends = [known for known in KEYS if known.split(".")[-1] == last]
    return f"; do you mean {ends[0]!r}?" if ends else near(key, KEYS)
