"""The verbs that need nothing but the format: info, verify, export."""

from pathlib import Path
from typing import Annotated

import typer

from meshshard.errors import UsageError
from meshshard.files import publish
from meshshard.index import INDEX_NAME
from meshshard.plain import to_json
from meshshard.remote import is_url, to_path

FEATURES = Path("data/features")

Data = Annotated[str, typer.Argument(help="Folder or URL with index.json, or a name in data/features.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON for machines.")]


def locate(name: str) -> Path:
    """The folder of shards that a command's argument means: itself, or data/features/NAME/paper."""
    if is_url(name):
        return to_path(name)
    for folder in (Path(name), FEATURES / name, FEATURES / name / "paper"):
        if (folder / INDEX_NAME).is_file():
            return folder
    if name.endswith(".toml"):
        raise UsageError(
            f"{name} describes raw meshes; their features are named by its key name, mostly {Path(name).stem!r}: "
            f"name that, and if there are none yet, type: meshshard features {name}"
        )
    raise UsageError(
        f"no features of {name!r}: neither {name} nor {FEATURES / name / 'paper'} holds an {INDEX_NAME}; "
        f"compute them with: meshshard features {name}"
    )


def info(
    data: Data,
    page: Annotated[
        Path | None, typer.Option(help="Write it as an HTML file with pictures instead.", metavar="FILE")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """What a data set holds, as numbers: sizes, class balance, diagnostics, error bounds, origin; or as a page with
    pictures.

    Examples: meshshard info minicoseg

    meshshard info minicoseg --page card.html
    """
    from meshshard.data_card.card import data_card  # opens every shard: numpy and h5py stay out of --help
    from meshshard.data_card.survey import survey
    from meshshard.data_card.tables import print_tables, tables
    from meshshard.dataset import open_dataset

    dataset = open_dataset(locate(data))
    seen = survey(dataset)
    card = data_card(dataset, seen)
    if page is not None:
        from meshshard.data_card.page import card_page  # the extra `pictures`

        if page.is_dir():
            raise UsageError(f"--page is the HTML file to write, and {page} is a folder")
        page.parent.mkdir(parents=True, exist_ok=True)
        publish(page, card_page(dataset, seen, card).encode())
    if as_json:
        typer.echo(to_json(card))
    elif page is not None:
        typer.echo(f"{page}: {page.stat().st_size:,} bytes")
    else:
        print_tables(tables(card).values())


def verify(
    data: Data,
    full: Annotated[bool, typer.Option("--full", help="Also check every array of every sample.")] = False,
    as_json: AsJson = False,
) -> None:
    """Check a folder of shards against its index: exit status 0 when it is whole, 1 when it is not.

    Example: meshshard verify minicoseg --full
    """
    from meshshard.verify import verify as find  # numpy and h5py stay out of --help

    folder = locate(data)
    findings = find(folder, full=full)
    if as_json:
        typer.echo(to_json({"folder": str(folder), "ok": not findings, "findings": findings}))
    else:
        for finding in findings:
            typer.echo(finding)
        typer.echo(f"{folder}: not whole, {len(findings)} found" if findings else f"{folder}: whole")
    raise typer.Exit(1 if findings else 0)


def export(
    data: Data,
    to: Annotated[str, typer.Option(help="Format: npz, ply, vtkhdf, pyg, diffusionnet, seg or eseg.")],
    out: Annotated[Path, typer.Option(help="Folder for the files, one for each mesh.")],
    split: Annotated[str | None, typer.Option(help="Only the meshes of this split.")] = None,
    id: Annotated[list[str] | None, typer.Option(help="Only meshes with such an id: * is any text.")] = None,
    colour: Annotated[
        str | None, typer.Option(help="Of ply: label, or a feature of vertices as dihedral or hks:3.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Write the meshes of a data set for other tools: a file for each, and export.json that lists them.

    Exit status 1 when a mesh cannot be written in the format; the others are.

    Examples: meshshard export minicoseg --to vtkhdf --out for_paraview

    meshshard export minicoseg --to ply --out pictures --split test --colour hks:3
    """
    from meshshard.dataset import open_dataset  # numpy and h5py stay out of --help
    from meshshard.export.formats import find_exporter
    from meshshard.export.select import select
    from meshshard.export.write import write_export

    dataset = open_dataset(locate(data))
    exporter = find_exporter(to, dataset, colour)
    report = write_export(dataset, select(dataset, split, id or []), to, exporter, out)
    if as_json:
        typer.echo(to_json(report))
    else:
        for message in report["refused"]:
            typer.echo(message)
        if exporter.note:
            typer.echo(f"note: {exporter.note}", err=True)
        typer.echo(f"{dataset.name}: {len(report['files'])} files, {report['bytes']} bytes -> {out}")
    raise typer.Exit(1 if report["refused"] else 0)
