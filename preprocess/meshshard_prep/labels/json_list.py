"""The form "json": a list of integers and names, or an object that holds one; null is unlabelled."""

import codecs
import json

import numpy as np

from meshshard_prep.labels.written import Written, bad_label

KEY = "labels"


def read_json(data: bytes, name: str, place: str) -> Written:
    """The list itself, or the one under the key `name` ("labels" if that is empty) of an object."""
    name = name or KEY
    advice = f'write a list, or an object with a list under the key "{name}"'
    try:
        content = json.loads(data.removeprefix(codecs.BOM_UTF8))
    except json.JSONDecodeError as error:
        raise bad_label("the file is JSON", error.msg, f"{place}:{error.lineno}", advice) from error
    except (ValueError, RecursionError) as error:  # text of another encoding, integers of thousands of digits
        raise bad_label("the file is JSON", str(error), place, advice) from error
    labels = content.get(name) if isinstance(content, dict) else content
    if not isinstance(labels, list):
        found = f"has the keys {list(content)[:8]}" if isinstance(content, dict) else f"is a {type(content).__name__}"
        raise bad_label("labels are a list", f"the file {found}", place, advice)

    def where(i: int) -> str:
        return f"{place}, label {i + 1}"

    if not {type(label) for label in labels} <= {int, str, type(None)}:
        first = next(i for i, label in enumerate(labels) if type(label) not in (int, str, type(None)))
        found = f"this one is {json.dumps(labels[first])[:40]}"
        raise bad_label("a label is an integer, a name or null", found, where(first))
    distinct: dict[int | str | None, int] = {None: -1}
    which = np.array([distinct.setdefault(label, len(distinct) - 1) for label in labels], dtype=np.int64)
    for number, value in enumerate(distinct, -1):
        if isinstance(value, str) and not _is_text(value):
            raise bad_label("a name is text", f"this one is {value!a}", where(int(np.argmax(which == number))))
    return Written(values=tuple(value for value in distinct if value is not None), which=which, place=where)


def _is_text(name: str) -> bool:
    """JSON can write half of a pair of surrogates, which no file can hold."""
    return not any("\ud800" <= character <= "\udfff" for character in name)
