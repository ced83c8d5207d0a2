"""The forms "obj-group" and "obj-material": the group, object or material that each face of an OBJ file is in."""

import codecs
import re
from collections.abc import Callable

import numpy as np

from meshshard_prep.formats.obj import statement_lines
from meshshard_prep.formats.text import decode
from meshshard_prep.labels.written import Written

STATEMENTS = {"obj-group": ("g", "o"), "obj-material": ("usemtl",)}

_COMMENT = re.compile(r"\s#.*")
_CONTINUED = re.compile(r"\\[ \t]*$")


def read_obj(statements: tuple[str, ...]) -> Callable[[bytes, str, str], Written]:
    """What reads labels that are the name behind the last of these statements before the face. Faces before the
    first, and behind one without a name, are unlabelled."""

    def read(data: bytes, _name: str, place: str) -> Written:
        text = decode(data.removeprefix(codecs.BOM_UTF8), place)
        distinct: dict[str, int] = {}
        current, which, lines = -1, [], []
        for number, (line, written) in enumerate(zip(statement_lines(text), text.split("\n"), strict=True), 1):
            keyword = line.split(maxsplit=1)[:1]
            if keyword == ["f"]:
                which.append(current)
                lines.append(number)
            elif keyword and keyword[0] in statements:
                name = _name_of(line, written)
                current = distinct.setdefault(name, len(distinct)) if name else -1
        return Written(
            values=tuple(distinct),
            which=np.array(which, dtype=np.int64),
            place=lambda i: f"{place}:{lines[i]}",
            domain="face",
        )

    return read


def _name_of(line: str, written: str) -> str:
    """Part#2 is a name: a comment needs a blank before it, other than behind numbers."""
    whole = line if _CONTINUED.search(written) else _COMMENT.sub("", written)
    return " ".join(whole.split()[1:])
