"""The form "psb": the Princeton segmentation benchmark's lists, a part's name and then the numbers of its faces."""

import codecs

import numpy as np
from jaxtyping import Int64

from meshshard_prep.formats.text import decode, first_refused, integers
from meshshard_prep.labels.written import Written, bad_label


def read_psb(data: bytes, _name: str, place: str) -> Written:
    """A line that begins with a digit or sign holds 1-based numbers of faces, any other is the name of the part that
    the numbers behind it belong to. Faces that no part names are unlabelled. InvalidMesh: numbers before any name,
    what is no number among them, or a face in two parts."""
    distinct: dict[str, int] = {}
    words: list[str] = []
    parts, sizes, lines = [], [], []
    for line, text in enumerate(decode(data.removeprefix(codecs.BOM_UTF8), place).split("\n"), 1):
        found = text.split()
        if not found:
            continue
        if found[0][0] not in "+-0123456789":
            current = distinct.setdefault(" ".join(found), len(distinct))
        elif distinct:
            words += found
            parts.append(current)
            sizes.append(len(found))
            lines.append(line)
        else:
            raise bad_label("the name of a part is before its faces", "there is none", f"{place}:{line}", ADVICE)
    line_of = np.repeat(np.array(lines, dtype=np.int64), sizes)
    try:
        numbers = integers(words)
    except ValueError:
        bad = first_refused(integers, words)
        raise bad_label(
            "numbers of faces are integers", f"this is {words[bad][:40]!r}", f"{place}:{line_of[bad]}", ADVICE
        ) from None
    if len(numbers) and numbers.min() < 1:
        bad = int(np.argmin(numbers))
        raise bad_label("faces count from 1", f"this is {numbers[bad]}", f"{place}:{line_of[bad]}", ADVICE)
    if not words:
        raise bad_label("a list of parts names faces", "this one names none", place, ADVICE)
    which = np.repeat(np.array(parts, dtype=np.int64), sizes)
    first = _first_of_each(numbers, which, line_of, tuple(distinct), place)
    numbers, which, line_of = numbers[first] - 1, which[first], line_of[first]
    return Written(
        values=tuple(distinct),
        which=which,
        place=lambda i: f"{place}:{line_of[i]}",
        domain="face",
        numbers=numbers,
    )


ADVICE = "write the name of a part on a line, and the numbers of its faces, from 1, on the next"


def _first_of_each(
    numbers: Int64[np.ndarray, " L"],
    which: Int64[np.ndarray, " L"],
    line_of: Int64[np.ndarray, " L"],
    names: tuple[str, ...],
    place: str,
) -> Int64[np.ndarray, " M"]:
    """Where each face is named first; InvalidMesh where another part names it again."""
    _, first, inverse = np.unique(numbers, return_index=True, return_inverse=True)
    again = which != which[first][inverse]
    if again.any():
        bad = int(np.argmax(again))
        found = f"face {numbers[bad]} is in {names[which[first[inverse[bad]]]][:40]!r} and {names[which[bad]][:40]!r}"
        raise bad_label("a face is in one part", found, f"{place}:{line_of[bad]}", "take it out of one of them")
    return first
