"""meshshard view: meshes in a browser."""

import os
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from meshshard.commands import locate
from meshshard.errors import UsageError
from meshshard.mesh_files import MESH_SUFFIXES
from meshshard.recipe import RECIPES, Recipe
from meshshard_train.commands.shared import Device, wait_quietly

if TYPE_CHECKING:
    from meshshard import Dataset


def view(
    what: Annotated[str, typer.Argument(help="A data set as for info, the folder of a run, or a mesh file.")],
    data: Annotated[
        str | None, typer.Option(help="Of a run: another data set or a mesh file (default: the one trained on).")
    ] = None,
    host: Annotated[str, typer.Option(help="Address to listen at; 0.0.0.0 lets other machines in.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(help="Port to listen at; 0 for any that is free.", min=0, max=65535)] = 8080,
    open_page: Annotated[
        bool | None, typer.Option("--open/--no-open", help="Open a browser (default: unless called over SSH).")
    ] = None,
    device: Device = "auto",
) -> None:
    """Look at meshes in a browser: a data set's, with a run's predictions beside their labels, or one mesh file.

    Examples: meshshard view minicoseg

    meshshard view runs/minicoseg

    meshshard view chair.obj --port 0
    """
    import viser  # noqa: F401  the extra `view`: asked for before features are computed

    from meshshard.view.serving import check_address, serve

    check_address(host, port)
    show = not os.environ.get("SSH_CONNECTION") if open_page is None else open_page
    run = Path(what)
    with tempfile.TemporaryDirectory() as scratch:
        if run.suffix == ".safetensors" or any(run.glob("*.safetensors")):
            wait_quietly()
            from meshshard_train import checkpoint
            from meshshard_train.device import choose_device
            from meshshard_train.judging import judge_of
            from meshshard_train.state import BEST

            where, best = choose_device(device), checkpoint.load(run if run.is_file() else run / BEST)
            dataset = _opened(data or best.state["folder"], best.recipe, Path(scratch))
            judge = judge_of(best, run, dataset, where)
        elif data:
            raise UsageError(f"--data is for the folder of a run, and {what} is none: name the data set alone")
        else:
            dataset, judge = _opened(what, RECIPES["paper"], Path(scratch)), None
        serve(dataset, judge, host, port, show)


def _opened(what: str, recipe: Recipe, scratch: Path) -> "Dataset":
    """A data set, or one that is made of a mesh file alone: the halves meet in files."""
    from meshshard import open_dataset
    from meshshard_train.prediction_inputs import computed

    if Path(what).is_file() and Path(what).suffix.lower() in MESH_SUFFIXES:
        return computed(Path(what), recipe, scratch, jobs=1)
    try:
        return open_dataset(locate(what))
    except UsageError as error:
        raise UsageError(f"{error}. Nor is it a mesh file, or the folder of a run") from error
