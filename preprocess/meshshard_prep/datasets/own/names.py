"""Meshes that a list names: by id, by path, by file name or stem, or by a pattern."""

import re
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path, PurePosixPath

from meshshard.errors import UsageError
from meshshard_prep.datasets.layout import Entry


class Names:
    """Finds the meshes of a data set."""

    def __init__(self, entries: Sequence[Entry]) -> None:
        self.entries = entries
        self._exact: dict[str, list[Entry]] = defaultdict(list)
        self._last: dict[str, list[Entry]] = defaultdict(list)
        for entry in entries:
            path = PurePosixPath(entry.source)
            for name in {entry.id, entry.source, path.with_suffix("").as_posix()}:
                self._exact[name].append(entry)
            for name in {path.name, path.stem}:
                self._last[name].append(entry)

    def find(self, name: str) -> list[Entry]:
        """The meshes of an id or a path below the raw folder; else those of a file name, with or without suffix."""
        name = name.removeprefix("./")
        return self._exact.get(name) or self._last.get(name) or []

    def one(self, name: str, place: str) -> list[Entry]:
        """The mesh of that name, or none. UsageError: it is the file name of several; `place` says who names it."""
        found = self.find(name)
        if len(found) > 1:
            known = ", ".join(entry.id for entry in found[:3])
            raise UsageError(f"{place}: {name!r} names {len(found)} meshes, {known}; write more of the path")
        return found

    def match(self, name: str, place: str) -> list[Entry]:
        """The same, or those whose id or path is like a pattern."""
        if found := self.one(name, place):
            return found
        pattern = glob_pattern(name, place)
        return [entry for entry in self.entries if pattern.fullmatch(entry.id) or pattern.fullmatch(entry.source)]

    @property
    def example(self) -> str:
        """A mesh as a list could name it."""
        return self.entries[0].id


def glob_pattern(glob: str, place: str) -> re.Pattern[str]:
    """A glob for paths: * and ? stay within a folder, **/ is any folders or none, [abc] is one of these.

    UsageError: a range like [z-a]; `place` says who has it.
    """
    parts = re.split(r"(\*\*/|\*\*|\*|\?|\[!?\]?[^]]*\])", glob)
    meaning = {"**/": "(?:.*/)?", "**": ".*", "*": "[^/]*", "?": "[^/]"}
    words = [
        meaning.get(part) or (f"[{'^' * (part[1] == '!')}{re.escape(part[1:-1].lstrip('!'))}]".replace("\\-", "-"))
        if number % 2
        else re.escape(part)
        for number, part in enumerate(parts)
    ]
    try:
        return re.compile("".join(words), re.DOTALL)
    except re.error as error:
        raise UsageError(f"{place}: {glob!r} is no pattern: {error}; write [[] for a bracket itself") from error


def rows_of(path: Path, place: str) -> list[tuple[int, str]]:
    """The lines of a list file with their numbers, without empty ones and comments. UsageError: it cannot be read;
    `place` says who asks for it."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        why = error.strerror if isinstance(error, OSError) else "it is no UTF-8 text"
        raise UsageError(f"{place}: the list {path} cannot be read: {why}") from error
    rows = [(number, line.strip()) for number, line in enumerate(text.splitlines(), start=1)]
    return [(number, line) for number, line in rows if line and not line.startswith("#")]
