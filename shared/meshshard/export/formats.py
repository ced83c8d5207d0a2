"""Formats by their names, from the entry points of every installed package."""

import inspect
from importlib.metadata import entry_points

from meshshard.dataset import Dataset
from meshshard.errors import UsageError
from meshshard.export import Exporter

GROUP = "meshshard.exporters"


def find_exporter(name: str, dataset: Dataset, colour: str | None = None) -> Exporter:
    """The exporter of a format, ready for a data set. Only that format's module, and what it needs, is imported.

    UsageError: no such format, a colour for a format without colours, or a data set that lacks what it needs.
    """
    known = {entry.name: entry for entry in entry_points(group=GROUP)}
    if name not in known:
        raise UsageError(f"no format is called {name!r}; --to is one of {', '.join(sorted(known))}")
    make = known[name].load()
    if colour is None:
        return make(dataset)
    if "colour" not in inspect.signature(make).parameters:
        raise UsageError(f"files of the format {name} have no colours: leave --colour out, or try --to ply")
    return make(dataset, colour)
