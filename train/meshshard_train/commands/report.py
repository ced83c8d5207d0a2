"""meshshard report: a run or a data set as one HTML file."""

from pathlib import Path
from typing import Annotated

import typer

from meshshard.commands import AsJson, locate
from meshshard.errors import UsageError
from meshshard.files import publish
from meshshard.index import INDEX_NAME
from meshshard.plain import to_json
from meshshard_train.commands.shared import Device, wait_quietly


def report(
    what: Annotated[str, typer.Argument(help="Folder of a run, or of train --seeds, or a data set as for info.")],
    out: Annotated[Path, typer.Option(help="The HTML file to write.", metavar="FILE")],
    data: Annotated[
        str | None, typer.Option(help="Of a run: where its data set is now (default: where it was).")
    ] = None,
    meshes: Annotated[
        int, typer.Option(help="Of a run: pictures of so many meshes, half the worst, half the best.", min=0)
    ] = 12,
    device: Device = "auto",
    as_json: AsJson = False,
) -> None:
    """Write all there is to know of a run, of several seeds, or of a data set as one HTML file without network.

    What cannot be shown is said in it, and here, with what to type.

    Examples: meshshard report runs/minicoseg --out report.html

    meshshard report minicoseg --out card.html
    """
    if out.is_dir():
        raise UsageError(f"--out is the HTML file to write, and {out} is a folder")
    folder = Path(what)
    if folder.suffix == ".safetensors":
        raise UsageError(f"{what} is a checkpoint: name the folder of its run, as meshshard report {folder.parent}")
    of_seeds, of_run = (folder / "seeds.json").is_file(), (folder / "config.json").is_file()
    if not (of_seeds or of_run):
        if data is not None:
            raise UsageError(f"--data is for the folder of a run, and {what} is none: name the data set alone")
        if folder.is_dir() and not (folder / INDEX_NAME).is_file():
            raise UsageError(
                f"{what} is no run (config.json), no runs of several seeds (seeds.json), and no data set "
                f"({INDEX_NAME}): name one, as runs/minicoseg"
            )
        page, missing = _card(what), []
    else:
        wait_quietly()
        from meshshard_train.device import choose_device  # torch: a data set is shown without it
        from meshshard_train.report.page import run_report, seeds_report

        found = seeds_report(folder, data) if of_seeds else run_report(folder, data, meshes, choose_device(device))
        page, missing = found.page, found.missing
    out.parent.mkdir(parents=True, exist_ok=True)
    publish(out, page.encode())
    if as_json:
        typer.echo(to_json({"file": str(out), "bytes": out.stat().st_size, "missing": missing}))
        return
    for line in missing:
        typer.echo(f"not in it: {line}", err=True)
    typer.echo(f"{out}: {out.stat().st_size:,} bytes")


def _card(data: str) -> str:
    from meshshard.data_card.card import data_card
    from meshshard.data_card.page import card_page
    from meshshard.data_card.survey import survey
    from meshshard.dataset import open_dataset

    dataset = open_dataset(locate(data))
    seen = survey(dataset)
    return card_page(dataset, seen, data_card(dataset, seen))
