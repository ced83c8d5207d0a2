"""Rows of a text PLY: all numbers are read at once, then the columns are told apart, each for all rows."""

import warnings
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64, Int64

from meshshard.errors import InvalidMesh
from meshshard_prep.formats.ply_columns import Column, Lists, spread, type_of
from meshshard_prep.formats.ply_header import CORNERS, Header, Property
from meshshard_prep.formats.text import decode, polygon_of, refusal, shown

_BLANK = np.isin(np.arange(256), list(b" \t\n"))
_WHOLE = np.isin(np.arange(256), list(b"0123456789+- \t\n"))


def text_rows(body: bytes, header: Header, place: str) -> dict[str, list[Column]]:
    """Element -> its columns, from the bytes behind the header; InvalidMesh names the first line that is wrong."""
    words = _Words.of(_checked(body, header, place))
    found, row = {}, 0
    for name, element in header.elements.items():
        rows = _Rows(words, row, name, header, place)
        found[name] = [rows.take(column) for column in element.properties]
        rows.finish()
        row += element.rows
    return found


def _checked(body: bytes, header: Header, place: str) -> str:
    """The rows as text, if they are as many as the header promises and have no characters that numbers have not."""
    text = decode(body, place, first_line=header.lines + 1).rstrip()
    lines = text.count("\n") + 1 if text else 0
    promised = sum(element.rows for element in header.elements.values())
    rule = f"the rows that the header promises have a line each ({promised})"
    if lines < promised:
        raise refusal("truncated", rule, f"{lines} follow it", place)
    if lines > promised:
        raise refusal("extra-data", rule, f"{lines} follow it", f"{place}:{header.lines + promised + 1}")
    if "_" in text or not text.isascii():
        rows = enumerate(text.split("\n"), start=header.lines + 1)
        line, row = next((line, row) for line, row in rows if "_" in row or not row.isascii())
        raise refusal("bad-number", "a row is made of numbers", f"this one is {shown(row)}", f"{place}:{line}")
    return text


@dataclass(frozen=True, eq=False, kw_only=True)
class _Words:
    """Word i starts at character `starts[i]` and is `values[i]`, if `is_number[i]`; line j has the words from
    `first[j]` to `first[j + 1]`. An integer is written with digits and a sign: `is_whole`."""

    text: str
    starts: Int64[np.ndarray, " W"]
    first: Int64[np.ndarray, " L1"]
    values: Float64[np.ndarray, " W"]
    is_number: Bool[np.ndarray, " W"]
    is_whole: Bool[np.ndarray, " W"]

    @classmethod
    def of(cls, text: str) -> "_Words":
        characters = np.frombuffer(text.encode(), np.uint8)
        blank = _BLANK[characters]
        starts = np.flatnonzero(~blank & np.concatenate([[True], blank])[:-1])
        lines = np.concatenate([[0], np.flatnonzero(characters == ord("\n")) + 1, [len(text)]])
        is_whole = np.ones(len(starts), bool)
        is_whole[np.searchsorted(starts, np.flatnonzero(~_WHOLE[characters]), side="right") - 1] = False
        values, is_number = _numbers(text, len(starts))
        first = np.searchsorted(starts, lines)
        return cls(
            text=text, starts=starts, first=first, values=values, is_number=is_number, is_whole=is_whole & is_number
        )

    def shown(self, word: int) -> str:
        return shown(self.text[self.starts[word] :][:60].split()[0])

    def are(self, kind: np.dtype, words: Int64[np.ndarray, " N"]) -> Bool[np.ndarray, " N"]:
        """Whether words are numbers of this kind, of whatever size."""
        return (self.is_number if kind.kind == "f" else self.is_whole)[words]

    def fit(self, kind: np.dtype, words: Int64[np.ndarray, " N"]) -> Bool[np.ndarray, " N"]:
        """Whether numbers lie in the range of a type; none is too large for a floating-point type, which has inf."""
        if kind.kind == "f":
            return np.ones(len(words), bool)
        limits, values = np.iinfo(kind), self.values[words]
        return (values >= limits.min) & (values <= limits.max)

    def read(self, kind: np.dtype, words: Int64[np.ndarray, " N"]) -> np.ndarray:
        """Numbers as a type. Some do not fit if there is a mistake: what is read then is not used."""
        with np.errstate(over="ignore", invalid="ignore"):
            return self.values[words].astype(kind)


def _numbers(text: str, count: int) -> tuple[Float64[np.ndarray, " W"], Bool[np.ndarray, " W"]]:
    """The value of each word, and whether it has one."""
    if count and "(" not in text:  # numpy reads nan(1), which is no decimal number
        with warnings.catch_warnings():
            warnings.simplefilter("error", DeprecationWarning)
            try:
                values = np.fromstring(text, np.float64, sep=" ")  # would read 1-2 as two numbers
            except (DeprecationWarning, ValueError):
                values = np.empty(0)
        if len(values) == count:
            return values, np.ones(count, bool)
    values, is_number = np.full(count, np.nan), np.ones(count, bool)
    for number, word in enumerate(text.split()):
        try:
            values[number] = float(word)
        except ValueError:
            is_number[number] = False
    return values, is_number


class _Rows:
    """The rows of one element, read column by column. Of several mistakes the first in the file is kept: rows from
    that one on are left out, so that a further mistake is in a row before."""

    def __init__(self, words: _Words, line: int, name: str, header: Header, place: str) -> None:
        rows = header.rows(name)
        self.words, self.name, self.header, self.place = words, name, header, place
        self.at = words.first[line : line + rows]
        self.stop = words.first[line + 1 : line + rows + 1]
        self.mistake: InvalidMesh | None = None

    def take(self, column: Property) -> Column:
        """The column that follows the last one taken; without meaning if there is a mistake."""
        kind = type_of(column.type)
        if not column.length_type:
            return self.words.read(kind, self._next(kind, column))
        length_kind = type_of(column.length_type, signed=False)
        lengths = self.words.read(np.dtype(np.int64), self._next(length_kind, column))
        there = np.minimum(lengths, self.stop - self.at)
        values = spread(self.at, there)
        bad = ~(self.words.are(kind, values) & self.words.fit(kind, values))
        if kind.kind == "u":
            bad |= np.signbit(self.words.values[values])  # -0 is taken alone, but was never in such a list
        if bad.any():
            first = int(np.argmax(bad))
            self._refuse(polygon_of(first, there), self._no_number(int(values[first]), column))
        self._check(lengths <= there, lambda _: self._too_few(column))
        self.at = self.at + lengths[: len(self.at)]
        return Lists(lengths=lengths, values=self.words.read(kind, values))

    def finish(self) -> None:
        """After the last column: raises the first mistake, if there is one."""
        rule = self._rule()
        self._check(
            self.at == self.stop,
            lambda row: ("bad-line", rule, f"this one goes on with {self.words.shown(int(self.at[row]))}"),
        )
        if self.mistake:
            raise self.mistake

    def _next(self, kind: np.dtype, column: Property) -> Int64[np.ndarray, " R"]:
        """The next word of each row, which is a number of this kind."""
        self._check(self.at < self.stop, lambda _: self._too_few(column))
        self._check(self.words.are(kind, self.at), lambda row: self._no_number(int(self.at[row]), column))
        self._check(
            self.words.fit(kind, self.at),
            lambda row: (
                "bad-number",
                f"{column.name} of {self.name} has numbers of the type {kind.name}",
                f"this row has {self.words.shown(int(self.at[row]))}",
            ),
        )
        words = self.at
        self.at = self.at + 1
        return words

    def _check(self, right: Bool[np.ndarray, " M"], mistake: Callable[[int], tuple[str, str, str]]) -> None:
        """Keep the first row that is not right."""
        wrong = ~right[: len(self.at)]
        if wrong.any():
            row = int(np.argmax(wrong))
            self._refuse(row, mistake(row))

    def _refuse(self, row: int, mistake: tuple[str, str, str]) -> None:
        self.mistake = refusal(*mistake, self.header.place_of(self.name, row, self.place))
        self.at, self.stop = self.at[:row], self.stop[:row]

    def _rule(self) -> str:
        return f"a row of {self.name} has the numbers that the header says"

    def _too_few(self, column: Property) -> tuple[str, str, str]:
        return "bad-line", self._rule(), f"this one ends before {column.name} is complete"

    def _no_number(self, word: int, column: Property) -> tuple[str, str, str]:
        found = f"{column.name} has {self.words.shown(word)}"
        if self.name == "face" and column.name in CORNERS:
            last = self.header.rows("vertex") - 1
            return "index-out-of-range", f"a face index is a whole number from 0 to {last}", found
        return "bad-number", f"{column.name} of {self.name} has numbers of the type {column.type}", found
