"""Sentences about what a raw folder lacks, or holds beside its layout."""

from collections import Counter
from collections.abc import Collection, Iterable
from pathlib import Path

from meshshard.mesh_files import mesh_files_below
from meshshard_prep.datasets.layout import Entry

MOST_NAMED = 10
"""More names than that make no sentence."""


def lacking(what: str, expected: Iterable[str], found: Collection[str]) -> tuple[str, ...]:
    """What is published and not there, by name: one sentence, or none."""
    missing = [name for name in expected if name not in found]
    more = f" and {len(missing) - MOST_NAMED} more" if len(missing) > MOST_NAMED else ""
    return (f"missing {what}: {', '.join(missing[:MOST_NAMED])}{more}",) if missing else ()


def not_read(root: Path, entries: Iterable[Entry]) -> tuple[str, ...]:
    """A sentence for each folder below `root` that holds meshes which the layout has no place for."""
    known = {entry.path for entry in entries}
    others = Counter(path.parent for path in mesh_files_below(root) if path not in known)
    return tuple(
        f"meshes that are not part of the layout, and were not read: {count} in "
        f"{'the raw folder' if folder == root else folder.relative_to(root).as_posix()}"
        for folder, count in sorted(others.items())
    )
