"""Results as JSON that every reader takes, and as tables: drawn on a terminal, plain lines elsewhere."""

import json
import math
import sys
from collections.abc import Sequence
from typing import Any


def to_json(value: Any) -> str:
    """Indented JSON; what is not a finite number becomes null, for JSON has no NaN."""
    return json.dumps(_finite(value), indent=1, allow_nan=False)


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(part) for part in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def print_table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Rows of text. Where nobody looks, one line each, cells parted by tabs, without the header."""
    if not sys.stdout.isatty():
        for row in rows:
            print("\t".join(row))
        return
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(*header, show_header=bool(header), show_lines=bool(header))
    for row in rows:
        table.add_row(*map(Text, row))  # not markup: a code stands in brackets
    Console().print(table)
