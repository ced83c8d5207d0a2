"""The data sets known by name, for `meshshard datasets`: as text for people, as a table for programs."""

from itertools import groupby
from textwrap import fill
from typing import Any

from meshshard_prep.datasets.layout import Adapter
from meshshard_prep.fetch.sources import source_of

WIDTH, INDENT = 118, 24


def as_table(adapters: list[Adapter]) -> dict[str, dict[str, Any]]:
    """Name -> what is known. `expected`: meshes of each split, or `meshes` where none is shipped, and `classes`;
    `fetch`: whether `meshshard fetch` knows where it is."""
    return {
        adapter.name: {
            "task": adapter.task,
            "summary": adapter.summary,
            "expected": {split or "meshes": count for split, count in adapter.expected.items()},
            "licence": adapter.licence,
            "citation": adapter.citation,
            "origin": adapter.origin,
            "folder": f"data/raw/{adapter.folder or adapter.name}",
            "fetch": source_of(adapter) is not None,
            "page": f"docs/datasets/{adapter.page}.md",
        }
        for adapter in adapters
    }


def as_text(adapters: list[Adapter]) -> str:
    """Task by task; what comes from one place is listed together, under one licence and citation."""
    lines = []
    for task in dict.fromkeys(adapter.task for adapter in adapters):
        lines += [task.upper(), ""]
        for _, together in groupby((adapter for adapter in adapters if adapter.task == task), _source):
            same = list(together)
            for summary, names in groupby(same, lambda adapter: adapter.summary):
                lines += _named(", ".join(adapter.name for adapter in names), summary)
            if source_of(same[0]):
                lines.append(_wrapped(f"fetch: meshshard fetch {same[0].name}"))
            lines += [_wrapped(f"from: {same[0].origin}"), _wrapped(f"licence: {same[0].licence}")]
            lines += [_wrapped(f"cite: {same[0].citation}")]
            lines += [""]
    return "\n".join(lines).rstrip()


def _source(adapter: Adapter) -> tuple[str, str, str]:
    return adapter.origin, adapter.licence, adapter.citation


def _named(names: str, summary: str) -> list[str]:
    """A summary beside its name, or below its names."""
    if len(names) < INDENT:
        return [f"{names:{INDENT}}{summary}"]
    return [fill(names, WIDTH), " " * INDENT + summary]


def _wrapped(text: str) -> str:
    return fill(text, WIDTH, initial_indent=" " * INDENT, subsequent_indent=" " * (INDENT + 2))
