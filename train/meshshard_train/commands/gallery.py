"""meshshard gallery: meshes in rows, as a picture."""

from pathlib import Path
from typing import Annotated

import typer

from meshshard.commands import AsJson, locate
from meshshard.errors import UsageError
from meshshard.plain import to_json
from meshshard_train.commands.shared import Device, wait_quietly


def gallery(
    what: Annotated[str, typer.Argument(help="A data set as for info, or the folder of a run.")],
    out: Annotated[Path, typer.Option(help="The PNG file to write.", metavar="FILE")],
    split: Annotated[
        str | None, typer.Option(help="Meshes of this split (default: of a run test, of a data set all).")
    ] = None,
    id: Annotated[list[str] | None, typer.Option(help="Only meshes with such an id: * is any text.")] = None,
    count: Annotated[int, typer.Option(help="So many of them, evenly spread.", min=1)] = 12,
    columns: Annotated[int, typer.Option(help="Meshes in a row.", min=1)] = 6,
    colour: Annotated[
        list[str] | None,
        typer.Option(
            help="label, prediction, errors, or a feature of vertices as dihedral, hks or hks:3; may be repeated "
            "(default: label, and of a run prediction below)."
        ),
    ] = None,
    data: Annotated[
        str | None, typer.Option(help="Of a run: another data set (default: the one trained on).")
    ] = None,
    device: Device = "auto",
    as_json: AsJson = False,
) -> None:
    """Draw meshes in rows, seen and lit alike, coloured by label, by prediction, or by a feature, with a legend.

    Examples: meshshard gallery runs/minicoseg --out gallery.png

    meshshard gallery minicoseg --out heat.png --colour hks --count 6
    """
    from meshshard import open_dataset

    if out.suffix.lower() != ".png":
        raise UsageError(f"--out is the PNG file to write, as gallery.png, not {out}")
    run, judge = Path(what), None
    if (run / "config.json").is_file():
        wait_quietly()
        from meshshard_train import checkpoint  # torch: a data set is drawn without it
        from meshshard_train.device import choose_device
        from meshshard_train.judging import judge_of
        from meshshard_train.state import BEST

        best = checkpoint.load(run / BEST)
        folder = Path(best.state["folder"])
        if data is None and not folder.exists():
            raise UsageError(f"{run} was trained on {folder}, which is not there: name its shards with --data FOLDER")
        dataset = open_dataset(locate(data or str(folder)))
        judge = judge_of(best, run, dataset, choose_device(device))
        split = "test" if split is None else split
        title = f"{dataset.name}, {split}; {best.config.protocol}"
    elif data is not None:
        raise UsageError(f"--data is for the folder of a run, and {what} is none: name the data set alone")
    else:
        dataset = open_dataset(locate(what))
        title = dataset.name + (f", {split}" if split else "")
    from meshshard.export.select import select
    from meshshard_train.gallery import draw_gallery, spread

    numbers = spread(select(dataset, split, id or []), count)
    if not numbers:
        raise UsageError(f"{dataset.folder} holds no mesh: all were refused, see meshshard status {dataset.folder}")
    usual = ["label", "prediction"] if judge else ["label"] if dataset.classes else ["hks"]
    out.parent.mkdir(parents=True, exist_ok=True)
    draw_gallery(out, dataset, numbers, colour or usual, judge, columns=columns, title=title)
    if as_json:
        ids = [dataset.ids[number] for number in numbers]
        typer.echo(to_json({"file": str(out), "bytes": out.stat().st_size, "meshes": ids}))
        return
    meshes = f"{len(numbers)} mesh{'es' * (len(numbers) > 1)}"
    typer.echo(f"{out}: {meshes}, {out.stat().st_size:,} bytes")
