"""What was found, as lines for a person and as a table for programs."""

import shlex
from collections.abc import Iterator, Sequence
from pathlib import PurePosixPath
from typing import Any

from meshshard_prep.datasets.layout import DOMAINS
from meshshard_prep.jobs import printable
from meshshard_prep.labels.of_mesh import PLURAL
from meshshard_prep.scan.known import meshes_of
from meshshard_prep.scan.labels import Labelling
from meshshard_prep.scan.look import Findings
from meshshard_prep.scan.reading import Reading
from meshshard_prep.scan.write import counted

SHOWN = 5
"""Of what may be thousands, the first are named."""


def as_text(findings: Findings, reading: Reading) -> str:
    """A line for each thing found, with its kind before it."""
    return "\n".join(f"{kind:12} {printable(text)}" for kind, text in _lines(findings, reading))


def _lines(findings: Findings, reading: Reading) -> Iterator[tuple[str, str]]:
    counts = [count for count in findings.counts.values() if not count.refusal]
    yield "meshes", f"{len(findings.entries):,}: {counted(count.format for count in counts) or 'none can be read'}"
    if counts:
        yield "", f"{_range([c.vertices for c in counts])} vertices, {_range([c.faces for c in counts])} faces"
    if findings.refused:
        yield "no meshes", f"{len(findings.refused)} files with a mesh's ending, as {findings.refused[0]}"
    for labelling in findings.labellings:
        yield from _labelling(labelling, len(findings.entries))
    if reading.kind == "none":
        yield "labels", "none found, and training needs them; the file has lines to fill in"
    if reading.kind == "none" and findings.left_out:
        yield "", f"not taken as labels: {_some(findings.left_out, 8)}; give labels an integer property of their own"
    if findings.lonely:
        yield "no mesh", f"{len(findings.lonely)} files look like labels of no mesh: {_some(findings.lonely)}"
    if findings.sets:
        yield "sets", f"{', '.join(findings.sets)} hold meshes and labels of their own"
    if findings.lists.classes:
        yield "class list", findings.lists.classes
    for unused in findings.lists.unused:
        yield "list", unused
    if findings.folders:
        meshes = findings.folders.meshes
        what = "classes" if reading.kind == "class folders" else "folders"
        yield what, _some([f"{name} ({count})" for name, count in meshes.items()], 40)
    splits = findings.splits
    if set(splits) != {""}:
        yield "splits", ", ".join(f"{count:,} {split or 'in none'}" for split, count in splits.items())
    for split, file in findings.lists.splits.items():
        yield "split list", f"{file} for {split}"
    if findings.others:
        yield (
            "other files",
            ", ".join(f"{count:,} {end or 'without ending'}" for end, count in findings.others.items()),
        )
    command = f"meshshard features {findings.known or findings.like} --raw {shlex.quote(str(findings.root))}"
    if findings.known:
        yield "known as", f"{findings.known}: {command}"
    if findings.like:
        yield (
            "laid out as",
            f"{findings.like} ({meshes_of(findings.like):,} meshes); if it is a part of it: {command}",
        )


def _labelling(labelling: Labelling, meshes: int) -> Iterator[tuple[str, str]]:
    where = labelling.pattern or "in the mesh files"
    what = labelling.form + f" {labelling.name!r}" * bool(labelling.name)
    fits = ", ".join(f"{labelling.fits[domain]:,} fit {PLURAL[domain]}" for domain in DOMAINS)
    yield "labels", f"{where} ({what}): of {meshes:,} meshes, {fits}"
    yield "", f"{len(labelling.values)} labels: {_some([f'{v} in {c:,}' for v, c in labelling.values.items()], 20)}"
    if labelling.missing:
        yield "", f"{len(labelling.missing)} meshes have no such file: {_some(labelling.missing)}"
    if labelling.sharing:
        yield "", f"{len(labelling.sharing)} meshes share their file with another one: {_some(labelling.sharing)}"
    if labelling.odd:
        yield "", f"{len(labelling.odd)} do not fit: {_some(labelling.odd, 2)}"


def _some(names: Sequence[str], most: int = SHOWN) -> str:
    return ", ".join(names[:most]) + f" and {len(names) - most:,} more" * (len(names) > most)


def _range(numbers: Sequence[int]) -> str:
    return f"{min(numbers):,} to {max(numbers):,}" if min(numbers) < max(numbers) else f"{min(numbers):,}"


def as_table(findings: Findings, reading: Reading) -> dict[str, Any]:
    """The same for programs."""
    counts = [count for count in findings.counts.values() if not count.refusal]
    return {
        "folder": printable(str(findings.root)),
        "known": findings.known,
        "like": findings.like,
        "meshes": len(findings.entries),
        "formats": {kind: sum(c.format == kind for c in counts) for kind in sorted({c.format for c in counts})},
        "endings": _endings(findings),
        "vertices": [min((c.vertices for c in counts), default=0), max((c.vertices for c in counts), default=0)],
        "faces": [min((c.faces for c in counts), default=0), max((c.faces for c in counts), default=0)],
        "no_meshes": [printable(refusal) for refusal in findings.refused],
        "reading": reading.kind,
        "labels": [_labelling_table(labelling) for labelling in findings.labellings],
        "labels_without_mesh": list(map(printable, findings.lonely)),
        "sets": list(map(printable, findings.sets)),
        "class_list": printable(findings.lists.classes),
        "class_folders": {
            printable(name): n for name, n in (findings.folders.meshes if findings.folders else {}).items()
        },
        "splits": findings.splits,
        "split_lists": findings.lists.splits,
        "unused_lists": list(map(printable, findings.lists.unused)),
        "other_files": findings.others,
    }


def _endings(findings: Findings) -> dict[str, int]:
    endings = [PurePosixPath(entry.source).suffix.lower() for entry in findings.entries]
    return {ending: endings.count(ending) for ending in sorted(set(endings))}


def _labelling_table(labelling: Labelling) -> dict[str, Any]:
    return {
        "files": printable(labelling.pattern),
        "form": labelling.form,
        "name": labelling.name,
        "fits": dict(labelling.fits),
        "labels": {str(value): count for value, count in labelling.values.items()},
        "missing": list(map(printable, labelling.missing)),
        "sharing": list(map(printable, labelling.sharing)),
        "odd": list(map(printable, labelling.odd)),
    }
