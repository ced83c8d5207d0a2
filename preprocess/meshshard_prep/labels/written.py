"""What a label file says, before anybody knows what it means."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Int64

from meshshard.errors import InvalidMesh

UNLABELLED = -1


@dataclass(frozen=True, eq=False, kw_only=True)
class Written:
    """Labels as written: label i is `values[which[i]]`, unlabelled where `which[i]` is -1.

    `values` are integers or names, in any order; one may be there twice, as 1 and 01 in a text. `place` names the
    file, and where lines say anything, the line of label i. `domain`: "face", "edge" or "vertex" where the file says
    what it counts, else empty.
    """

    values: tuple[int | str, ...]
    which: Int64[np.ndarray, " L"]
    place: Callable[[int], str]
    domain: str = ""

    def classes(self, table: Mapping[int | str, int]) -> Int64[np.ndarray, " L"]:
        """Class index of each label. InvalidMesh: a value that is no class; the integer -1 is unlabelled."""
        table = {**table, UNLABELLED: UNLABELLED}
        for number, value in enumerate(self.values):
            if value not in table:
                raise InvalidMesh(
                    "bad-label",
                    f"a label is one of {', '.join(map(str, in_order(table)))}",
                    f"this one is {str(value)[:40]!r}",
                    place=self.place(int(np.argmax(self.which == number))),
                    advice="correct it; -1 says unlabelled",
                )
        indices = np.array([*(table[value] for value in self.values), UNLABELLED], dtype=np.int64)
        return indices[self.which]


def in_order(values: Iterable[int | str]) -> list[int | str]:
    """Integers rising, then names in alphabetical order."""
    return sorted(values, key=lambda value: (isinstance(value, str), value))
