"""The verb `generate`."""

from pathlib import Path
from typing import Annotated

import typer

from meshshard.commands import AsJson
from meshshard.errors import UsageError
from meshshard.plain import to_json


def generate(
    folder: Annotated[Path, typer.Argument(help="Where the meshes go: an empty folder, or an unfinished one.")],
    family: Annotated[
        list[str] | None, typer.Option(help="chair, vase or alien; may be given several times (default: all).")
    ] = None,
    count: Annotated[int, typer.Option(help="Meshes in all; the families take turns.", min=1)] = 300,
    faces: Annotated[
        int | None, typer.Option(help="About how many each has, 200 to 100000 (default: 700 to 1400, drawn).")
    ] = None,
    seed: Annotated[int, typer.Option(help="Everything random comes from it.", min=0)] = 0,
    holes: Annotated[bool, typer.Option("--holes", help="Damage meshes: an open border or a hole.")] = False,
    nonmanifold: Annotated[
        bool, typer.Option("--nonmanifold", help="Damage meshes: edges with three faces.")
    ] = False,
    pieces: Annotated[bool, typer.Option("--pieces", help="Damage meshes: several closed pieces.")] = False,
    damaged: Annotated[
        float | None, typer.Option(help="Share that is damaged so, the kinds in turn (default: 1).")
    ] = None,
    jobs: Annotated[int, typer.Option(help="Processes; -1 for one a core.")] = -1,
    as_json: AsJson = False,
) -> None:
    """Make chairs, vases and aliens with a part label for each face: a data set of any size to try things on.

    Stopped and called again, it goes on. A data set of its kind comes with meshshard: minicoseg.

    Examples: meshshard generate test_bed --count 1000 --faces 500

    meshshard generate broken_vases --family vase --holes --nonmanifold --damaged 0.5
    """
    from meshshard_prep.minicoseg import FAMILIES, Collection
    from meshshard_prep.minicoseg import generate as write
    from meshshard_prep.minicoseg.layout import Defect
    from meshshard_prep.progress import progress

    if jobs == 0:
        raise UsageError("--jobs is the number of processes, or -1 for one a core; it cannot be 0")
    wanted: dict[Defect, bool] = {"open": holes, "nonmanifold": nonmanifold, "pieces": pieces}
    if damaged is not None and not any(wanted.values()):
        raise UsageError("--damaged is the share of meshes with --holes, --nonmanifold or --pieces: give one of them")
    try:
        collection = Collection(
            seed=seed,
            count=count,
            families=tuple(family or FAMILIES),
            faces=faces,
            defects=tuple(defect for defect, on in wanted.items() if on),
            damaged=1.0 if damaged is None else damaged,
        )
        with progress("generate") as tell:
            made = write(folder, collection, jobs=jobs, progress=tell)
    except (ValueError, FileExistsError) as error:
        raise UsageError(str(error)) from error
    except KeyboardInterrupt:
        raise UsageError("stopped; what is done is kept: the same command goes on from there") from None
    if as_json:
        typer.echo(to_json({"folder": str(folder), "meshes": count, "made": made}))
        return
    typer.echo(f"{count} meshes ({made} new) -> {folder}\nnext: meshshard features {folder / 'dataset.toml'}")
