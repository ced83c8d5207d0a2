"""One JSON file with the labels of all meshes, under a key for each."""

import json
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path, PurePosixPath

from meshshard_prep.counts import Counts
from meshshard_prep.datasets.own.labels import filled_in
from meshshard_prep.labels.json_list import read_json
from meshshard_prep.labels.written import Written
from meshshard_prep.scan.labels import LEAST_SHARE, Labelling, Told, labelling_of

KEYS = ("{stem}", "{name}", "{folder}/{stem}", "{folder}/{name}")
"""What the key of a mesh may be, the simplest first."""

MOST_BYTES = 200_000_000
"""A larger file would be too slow to read for each mesh."""


def labels_in_one_json(
    root: Path, others: Sequence[str], counts: Mapping[str, Counts], told: Told
) -> list[Labelling]:
    """A labelling for each JSON file that has the labels of at least LEAST_SHARE of the meshes."""
    found = []
    for other in others:
        content = _object(root / other) if PurePosixPath(other).suffix.lower() == ".json" else {}
        for pattern in KEYS if content else ():
            keys = {mesh: key for mesh in counts if (key := filled_in(pattern, mesh)) in content}
            if len(keys) < max(LEAST_SHARE * len(counts), 2) or len({*keys.values()}) < len(keys):
                continue
            read = partial(_read, content, keys, other)
            labelling = labelling_of(other, "json", pattern, read, list(keys), counts, told)
            found += [labelling] if labelling else []
            break
    return found


def _read(content: Mapping[str, object], keys: Mapping[str, str], place: str, mesh: str) -> Written:
    return read_json(json.dumps(content[keys[mesh]]).encode(), "", f"{place}, key {keys[mesh]!r}")


def _object(path: Path) -> dict[str, object]:
    """What the file holds, if that is an object and not too large; else an empty one."""
    if path.stat().st_size > MOST_BYTES:
        return {}
    try:
        content = json.loads(path.read_text(encoding="utf-8-sig"))
    except (OSError, ValueError, RecursionError):
        return {}
    return content if isinstance(content, dict) else {}
