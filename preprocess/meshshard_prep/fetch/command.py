"""The verb `fetch`."""

import shlex
import sys
from collections import Counter
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from meshshard.commands import AsJson
from meshshard.errors import UsageError
from meshshard.plain import to_json
from meshshard.remote import local_folder

if TYPE_CHECKING:
    from meshshard_prep.datasets import Adapter
    from meshshard_prep.fetch.fetch import Fetched
    from meshshard_prep.fetch.source import Source


def fetch(
    dataset: Annotated[str, typer.Argument(help="Name of a data set.", metavar="NAME")],
    archive: Annotated[
        list[Path] | None,
        typer.Option(help="An archive that was downloaded by hand; may be given again.", metavar="FILE"),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Folder of the raw files; data/raw/NAME if not given.", parser=local_folder, metavar="DIR"),
    ] = None,
    yes: Annotated[bool, typer.Option("--yes", help="Accept the licence without being asked.")] = False,
    force: Annotated[bool, typer.Option("--force", help="Fetch again, and replace what was fetched before.")] = False,
    as_json: AsJson = False,
) -> None:
    """Load the raw files of a known data set from where they are published, check them and unpack them.

    Licence, citation and address are shown first and have to be accepted.

    Examples: meshshard fetch human_seg

    meshshard fetch intra --archive ~/Downloads/IntrA.zip
    """
    from meshshard_prep.datasets import ADAPTERS
    from meshshard_prep.fetch.fetch import assign, is_there, working_folder
    from meshshard_prep.fetch.fetch import fetch as run
    from meshshard_prep.fetch.progress import download_progress
    from meshshard_prep.fetch.sources import source_of

    if dataset not in ADAPTERS:
        known = ", ".join(name for name in ADAPTERS if source_of(ADAPTERS[name]))
        raise UsageError(f"{dataset!r} is no known data set; those that can be fetched are {known}")
    adapter, source, given = ADAPTERS[dataset], source_of(ADAPTERS[dataset]), archive or []
    if source is None:
        raise UsageError(f"{dataset} cannot be fetched: {adapter.origin}")
    folder = out.resolve() if out else Path("data/raw") / (adapter.folder or dataset)
    then = f"meshshard features {dataset}" + f" --raw {shlex.quote(str(folder))}" * bool(out)
    if is_there(folder) and not force:
        _report(dataset, folder, None, then, as_json)
        return
    _accept(adapter, source, assign(dataset, source, given), folder, yes)
    try:
        with download_progress() as tell:
            done = run(dataset, source, folder, tell, given=given, replace=force)
    except KeyboardInterrupt:
        raise UsageError(
            f"stopped; what was loaded is kept in {working_folder(folder)}: the same command goes on from there"
        ) from None
    _report(dataset, folder, done, then, as_json)


def _accept(adapter: "Adapter", source: "Source", given: dict[str, list[Path]], folder: Path, yes: bool) -> None:
    """Show what would be loaded under which conditions, and have it accepted. UsageError: it is not."""
    lines = []
    for item in source.archives:
        size = f" ({item.size / 1e6:.1f} MB)" if item.size else ""
        lines += [f"from: {path}" for path in given[item.file]] or [f"from: {item.url}{size}"]
    typer.echo(f"{adapter.name}: {adapter.summary}", err=True)
    for line in (
        f"licence: {adapter.licence}",
        f"cite: {adapter.citation}",
        f"page: {source.page}",
        *lines,
        f"to: {folder}",
    ):
        typer.echo(f"  {line}", err=True)
    if yes:
        return
    if not sys.stdin.isatty():
        raise UsageError("nobody is here to accept these conditions: type the same command with --yes")
    if not typer.confirm("Load it under these conditions?", err=True):
        raise UsageError("not accepted; nothing was loaded")


def _report(name: str, folder: Path, done: "Fetched | None", then: str, as_json: bool) -> None:
    if as_json:
        table: dict[str, object] = {"name": name, "folder": str(folder), "fetched": done is not None}
        if done:
            table["meshes"] = Counter(entry.split for entry in done.dataset.entries)
            table["classes"] = len(done.dataset.classes)
            table["archives"] = [asdict(archive) for archive in done.archives]
            table["notes"] = done.notes
        typer.echo(to_json(table))
        return
    if done is None:
        typer.echo(f"{folder} is there already, and nothing was loaded; --force fetches it again")
        return
    for note in done.notes:
        typer.echo(f"note: {note}", err=True)
    counts = Counter(entry.split for entry in done.dataset.entries)
    meshes = ", ".join(f"{count} {split}".strip() for split, count in counts.items())
    typer.echo(f"{name}: {meshes} meshes, {len(done.dataset.classes)} classes -> {folder}")
    typer.echo(f"next: {then}")
