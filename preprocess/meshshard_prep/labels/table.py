"""The form "last-column": a table of numbers, whose last column is the label."""

import codecs

import numpy as np

from meshshard_prep.labels.written import Written, bad_label, whole_numbers


def read_table(data: bytes, _name: str, place: str) -> Written:
    """A row for each label, of as many words between blanks as the first; empty lines may only end the file."""
    rows = data.removeprefix(codecs.BOM_UTF8).rstrip().splitlines()
    columns = len(rows[0].split()) if rows else 0

    def where(i: int) -> str:
        return f"{place}:{i + 1}"

    labels = np.empty(len(rows))
    for i, row in enumerate(rows):
        words = row.split()
        if len(words) != columns or not words:
            raise bad_label(
                f"the rows of the table have {columns} columns, as the first", f"this has {len(words)}", where(i)
            )
        try:
            labels[i] = float(words[-1])
        except ValueError:
            found = f"this one is {words[-1][:40].decode(errors='replace')!r}"
            raise bad_label("the last column is a number", found, where(i)) from None
    return Written.of_integers(whole_numbers(labels, where, "labels"), where)
