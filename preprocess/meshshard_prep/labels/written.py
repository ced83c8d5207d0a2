"""What a label file says, before anybody knows what it means."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int64, Shaped

from meshshard.errors import InvalidMesh

UNLABELLED = -1


@dataclass(frozen=True, eq=False, kw_only=True)
class Written:
    """Labels as written: label i is `values[which[i]]`, unlabelled where `which[i]` is -1.

    `values` are integers or names, in any order; one may be there twice, as 1 and 01 in a text. `place` names the
    file, and where lines say anything, the line of label i. `domain`: "face", "edge" or "vertex" where the file says
    what it counts, else empty. `numbers`: what label i is of, from 0, none twice, where the file names it and the
    others are unlabelled; None where labels are listed for all, in order.
    """

    values: tuple[int | str, ...]
    which: Int64[np.ndarray, " L"]
    place: Callable[[int], str]
    domain: str = ""
    numbers: Int64[np.ndarray, " L"] | None = None

    @classmethod
    def of_integers(
        cls, labels: Shaped[np.ndarray, " L"], place: Callable[[int], str], domain: str = ""
    ) -> "Written":
        """Labels that are an array of integers, of whatever type."""
        values, which = np.unique(labels, return_inverse=True)
        return cls(values=tuple(map(int, values)), which=which.astype(np.int64), place=place, domain=domain)

    def classes(self, table: Mapping[int | str, int]) -> Int64[np.ndarray, " L"]:
        """Class index of each label. InvalidMesh: a value that is no class; the integer -1 is unlabelled."""
        table = {**table, UNLABELLED: UNLABELLED}
        for number, value in enumerate(self.values):
            if value not in table:
                raise bad_label(
                    f"a label is one of {', '.join(map(str, in_order(table)))}",
                    f"this one is {str(value)[:40]!r}",
                    self.place(int(np.argmax(self.which == number))),
                )
        indices = np.array([*(table[value] for value in self.values), UNLABELLED], dtype=np.int64)
        return indices[self.which]


def bad_label(rule: str, found: str, place: str, advice: str = "correct it; -1 says unlabelled") -> InvalidMesh:
    """An InvalidMesh to raise for what a label file has and should not."""
    return InvalidMesh("bad-label", rule, found, place=place, advice=advice)


def whole_numbers(values: Float[np.ndarray, " L"], place: Callable[[int], str], what: str) -> Int64[np.ndarray, " L"]:
    """Floating-point numbers as integers. InvalidMesh names the first that is none; `what` says whose they are."""
    whole = np.isfinite(values) & (values == np.rint(values)) & (np.abs(values) < 2.0**53)
    if not whole.all():
        first = int(np.argmin(whole))
        raise bad_label(f"{what} are whole numbers", f"this one is {values[first]:.9g}", place(first))
    return values.astype(np.int64)


def in_order(values: Iterable[int | str]) -> list[int | str]:
    """Integers rising, then names in alphabetical order."""
    return sorted(values, key=lambda value: (isinstance(value, str), value))
