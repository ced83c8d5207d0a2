"""The card as tables of text: what the terminal and the page show."""

import sys
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from meshshard.sample import DIAGNOSTICS

NOTHING = "-"


@dataclass(frozen=True)
class Table:
    """Rows of cells under a header; the first cell names a row. An empty header: two columns, name and value."""

    title: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def tables(card: dict[str, Any]) -> dict[str, Table]:
    """All of a card, part by part; parts with nothing in them are left out."""
    found = {
        "facts": _facts(card),
        "sizes": _sizes(card),
        "classes": _classes(card),
        "diagnostics": _diagnostics(card),
        "rejected": _rejected(card),
        "origin": _origin(card),
    }
    return {name: table for name, table in found.items() if table.rows}


def shown(text: object) -> str:
    """One line of text that moves no cursor: names come from files."""
    return "".join(sign if sign.isprintable() else "\N{REPLACEMENT CHARACTER}" for sign in str(text))


def print_tables(tables: Iterable[Table]) -> None:
    """On a terminal drawn, elsewhere plain lines: a title, rows with cells parted by tabs, an empty line."""
    if not sys.stdout.isatty():
        for table in tables:
            lines = [table.title, *("\t".join(row) for row in (table.header, *table.rows) if row), ""]
            print("\n".join(lines))
        return
    from rich import box
    from rich.console import Console
    from rich.table import Table as Drawn
    from rich.text import Text

    console = Console()
    for table in tables:
        console.print(Text(table.title, style="bold"))
        drawn = Drawn(box=box.SIMPLE_HEAD, show_header=bool(table.header))
        for place, name in enumerate(table.header or ("", "")):
            drawn.add_column(Text(name), justify="right" if place and table.header else "left", overflow="fold")
        for row in table.rows:
            drawn.add_row(*map(Text, row))  # not markup: names may have brackets
        console.print(drawn)


def _facts(card: dict[str, Any]) -> Table:
    plural = {"face": "faces", "edge": "edges", "vertex": "vertices", "mesh": "the whole mesh"}
    labels = [f"of {plural[domain]} in {count} meshes" for domain, count in card["label_domains"].items()]
    rows = [
        ("task", card["task"]),
        ("meshes", f"{card['meshes']:,}"),
        ("labels", "; ".join(labels)),
        *(("labels converted", f"{rule} ({count} meshes)") for rule, count in card["label_rules"].items()),
        ("licence", card["licence"]),
        ("cite", card["citation"]),
        *(("note", note) for note in card["notes"]),
    ]
    return Table(card["dataset"], (), tuple((name, shown(value)) for name, value in rows if value))


def _sizes(card: dict[str, Any]) -> Table:
    parts = _parts(card)
    rows = [("meshes", *(f"{part['meshes']:,}" for part in parts))]
    for what in ("vertices", "faces"):
        rows.append((what, *(f"{part[what]['sum']:,}" for part in parts)))
        for figure in ("least", "median", "most"):
            rows.append((f"{what} of a mesh, {figure}", *(_number(part[what][figure], ",.10g") for part in parts)))
    for figure in ("median", "largest"):
        bounds = (_number(part["hks_error_bound"][figure], ".1e") for part in parts)
        rows.append((f"error bound of hks, {figure}", *bounds))
    return Table("Sizes", _header(card), tuple(rows))


def _classes(card: dict[str, Any]) -> Table:
    what, parts = " or ".join(card["labelled"]), _parts(card)
    rows = [(shown(name), *(_shares(part, number) for part in parts)) for number, name in enumerate(card["classes"])]
    if card["all"]["unlabelled"]:
        rows.append((f"unlabelled {what}", *(f"{part['unlabelled']:,}" for part in parts)))
    area = any(row["area_share"] is not None for row in card["all"]["classes"])
    return Table(f"Classes: share of {what}{', of area' if area else ''}, in %", _header(card), tuple(rows))


def _shares(part: dict[str, Any], number: int) -> str:
    row = part["classes"][number]
    if not part["meshes"]:
        return NOTHING
    if not row["count"]:
        return "missing"
    return ", ".join(f"{100 * row[share]:.1f}" for share in ("count_share", "area_share") if row[share] is not None)


def _diagnostics(card: dict[str, Any]) -> Table:
    found = {name: [part["diagnostics"][name] for part in _parts(card)] for name in DIAGNOSTICS}
    rows = [
        (name, *(f"{count['sum']:,} in {count['meshes']:,}" if count["meshes"] else NOTHING for count in counts))
        for name, counts in found.items()
        if counts[-1]["meshes"]
    ]
    return Table("Diagnostics: sum, and meshes that have some", _header(card), tuple(rows))


def _rejected(card: dict[str, Any]) -> Table:
    rows = [
        (word, shown(code), f"{count:,}")
        for word in ("refused", "failed")
        for code, count in card[word]["codes"].items()
    ]
    return Table("Not stored", ("", "code", "meshes"), tuple(rows))


def _origin(card: dict[str, Any]) -> Table:
    rule = [card["split_rule"], f"seed {card['split_seed']}"]
    rule += [f"{card['val_fraction']:g} of train to validation where none is given"] * (card["val_fraction"] > 0)
    rule += [f"{card['train_fraction']:g} of train kept"] * (card["train_fraction"] < 1)
    rows = [
        ("splits", "; ".join(rule)),
        ("recipe", f"{card['recipe']['name']}: {card['recipe_words']}"),
        ("algorithm version", card["algorithm_version"]),
        ("on disk", f"{card['bytes']:,} bytes, shards: {card['shards']}"),
        ("folder", card["folder"]),
        ("content_sha256", card["content_sha256"]),
        ("splits_sha256", card["splits_sha256"]),
    ]
    return Table("Origin", (), tuple((name, shown(value)) for name, value in rows))


def _header(card: dict[str, Any]) -> tuple[str, ...]:
    names = [shown(name or "(no split)") for name in card["splits"]]
    return ("", *names, *["all"] * (len(names) != 1))


def _parts(card: dict[str, Any]) -> list[dict[str, Any]]:
    """A column for each split, and one for all where they are not one."""
    return [*card["splits"].values(), *[card["all"]] * (len(card["splits"]) != 1)]


def _number(value: int | float | None, form: str) -> str:
    return NOTHING if value is None else format(value, form)
