"""The table [splits]: by lists, by fractions, or by folds; without it, by folders. Groups stay together."""

import math
import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from meshshard.splits import Member, draw_folds, draw_fractions
from meshshard_prep.datasets.layout import SPLITS, Draw, Entry, RawDataset
from meshshard_prep.datasets.own.document import Document, near
from meshshard_prep.datasets.own.names import Names, rows_of

LISTS = tuple(f"splits.{split}" for split in SPLITS)


def with_splits(document: Document, dataset: RawDataset, root: Path, draw: Draw) -> RawDataset:
    """The data set with the groups and the splits of its file. UsageError: mistakes, with the line."""
    if "splits.group" in document:
        dataset = replace(dataset, entries=_grouped(document, dataset.entries))
    ways = [key for key in (*LISTS, "splits.fractions", "splits.folds") if key in document]
    if len(set(ways) - set(LISTS)) + any(key in LISTS for key in ways) > 1:
        raise document.wrong(ways[-1], f"says how meshes are split, and so does {ways[0]}; keep one of them")
    if draw.fold and "splits.folds" not in document:
        raise document.wrong("splits.folds", f"is not there, so there is no fold {draw.fold}; leave out --fold")
    members = _members(dataset.entries)
    units = ", class by class" if len({member.label for member in members}) > 1 else ""
    units = ", whole groups" if any(member.group for member in members) else units
    if "splits.fractions" in document:
        fractions = _fractions(document)
        shares = ", ".join(f"{share:g} {split}" for split, share in fractions.items())
        return replace(
            dataset,
            drawn=draw_fractions(members, fractions, draw.seed),
            split_rule=f"drawn by seed{units}: {shares}",
        )
    if "splits.folds" in document:
        folds = document.get("splits.folds")
        if folds > len(members):
            raise document.wrong("splits.folds", f"is at most the number of meshes, {len(members)}, not {folds}")
        if draw.fold >= folds:
            raise document.wrong("splits.folds", f"is {folds}: --fold is 0 to {folds - 1}, not {draw.fold}")
        found = draw_folds(members, folds, draw.seed)
        return replace(
            dataset,
            drawn={name: "test" if fold == draw.fold else "train" for name, fold in found.items()},
            split_rule=f"fold {draw.fold} of {folds} is test, drawn by seed{units}",
        )
    return _by_lists(document, dataset, root) if ways else dataset


def _members(entries: tuple[Entry, ...]) -> list[Member]:
    """Meshes as draws see them: those of one class, or whose labels may have the same classes, as those of a folder
    with its own, are split in the same shares."""
    kinds = [tuple(sorted(set(e.labels.classes.values()))) if e.labels else (e.mesh_label,) for e in entries]
    number = {kind: place for place, kind in enumerate(sorted(set(kinds)))}
    return [Member(entry.id, number[kind], entry.group) for entry, kind in zip(entries, kinds, strict=True)]


def _grouped(document: Document, entries: tuple[Entry, ...]) -> tuple[Entry, ...]:
    """The group of a mesh is what the pattern's parentheses hold in its id; by itself where it does not match."""
    text = document.get("splits.group")
    try:
        pattern = re.compile(text)
    except (re.error, OverflowError, RecursionError) as error:
        raise document.wrong("splits.group", f"is a regular expression, and {text!r} is none: {error}") from None
    if pattern.groups != 1:
        raise document.wrong("splits.group", f"has one pair of parentheses, as '(.*)_pose', not {text!r}")
    found = {entry.id: match[1] or "" for entry in entries if (match := pattern.search(entry.id))}
    if not found:
        raise document.wrong("splits.group", f"matches no mesh: {text!r} is not in {entries[0].id!r}, say")
    return tuple(replace(entry, group=found.get(entry.id, entry.id)) for entry in entries)


def _fractions(document: Document) -> dict[str, float]:
    fractions: Mapping[str, float] = document.get("splits.fractions")
    for split in fractions:
        if split not in SPLITS:
            rule = f"are of {', '.join(SPLITS)}, not {split!r}{near(split, SPLITS)}"
            raise document.wrong("splits.fractions", rule, split)
    if not math.isclose(sum(fractions.values()), 1, abs_tol=1e-6):
        raise document.wrong("splits.fractions", f"sum to 1, not {sum(fractions.values()):g}")
    # train last: it takes what rounding leaves, and of few meshes the others get one each
    return {split: fractions[split] for split in reversed(SPLITS) if split in fractions}


def _by_lists(document: Document, dataset: RawDataset, root: Path) -> RawDataset:
    """What no list names is train where there is no list of that, else in no split, which is noted."""
    rest = "" if "splits.train" in document else "train"
    drawn = dict.fromkeys((entry.id for entry in dataset.entries), rest)
    taken: dict[str, str] = {}
    notes = list(dataset.notes)
    names = Names(dataset.entries)
    for split, key in zip(SPLITS, LISTS, strict=True):
        strange = []
        for place, name in _items(document, key, root):
            found = names.match(name, place)
            strange += [] if found else [(place, name)]
            for entry in found:
                if taken.setdefault(entry.id, split) != split:
                    raise document.wrong(key, f"has {entry.id!r} ({place}), which is in {taken[entry.id]} too")
                drawn[entry.id] = split
        if strange and split not in taken.values():
            place, name = strange[0]
            rule = f"names no mesh: {name!r} ({place}) is none; a mesh is named as {names.example!r}"
            raise document.wrong(key, rule + near(name, drawn))
        if strange:
            place, name = strange[0]
            notes.append(f"{place}: {len(strange)} names of {key} are no meshes, the first is {name!r}")
    left = [name for name, split in drawn.items() if not split]
    if left:
        notes.append(
            f"{document.place('splits.train')}: {len(left)} meshes are in no list, and so in no split; the "
            f"first is {left[0]}"
        )
    return replace(dataset, drawn=drawn, split_rule="by lists", notes=tuple(notes))


def _items(document: Document, key: str, root: Path) -> list[tuple[str, str]]:
    """Place and name of all that a list has: a list in the TOML file, or a file of one name a line below raw."""
    value = document.get(key, [])
    if isinstance(value, list):
        return [(document.place(key, number), name) for number, name in enumerate(value)]
    path = root / value
    return [(f"{path.name}:{number}", line) for number, line in rows_of(path, document.place(key))]
