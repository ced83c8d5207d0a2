"""meshshard predict: classes for mesh files that were never in a data set."""

import tempfile
from pathlib import Path
from typing import Annotated, Any

import typer

from meshshard.commands import AsJson
from meshshard.errors import UsageError
from meshshard.plain import to_json
from meshshard_train.commands.shared import Device


def predict(
    run: Annotated[Path, typer.Argument(help="Folder of a run, or a checkpoint file of one.")],
    mesh: Annotated[list[Path], typer.Argument(help="Mesh files, or folders of them.")],
    out: Annotated[Path, typer.Option(help="Folder for the results.")] = Path("predictions"),
    vote: Annotated[
        int | None, typer.Option(help="Rounds of voting (default: what the run chose on validation).", min=0)
    ] = None,
    no_pictures: Annotated[bool, typer.Option("--no-pictures", help="Draw no PNG.")] = False,
    jobs: Annotated[int, typer.Option(help="Processes; -1 for one a core.")] = -1,
    device: Device = "auto",
    as_json: AsJson = False,
) -> None:
    """Label meshes that were never in a data set: raw files in; coloured PLY, PNG, label file and more out.

    Features are computed with the recipe stored in the checkpoint. Exit status 1 when a mesh was refused.

    Examples: meshshard predict runs/minicoseg chair.obj --out labelled

    meshshard predict best.safetensors my_folder_of_meshes --no-pictures --json
    """
    from meshshard_train import checkpoint
    from meshshard_train.commands.mesh_bar import mesh_bar
    from meshshard_train.device import choose_device
    from meshshard_train.labelling import known_rounds, label_meshes, outputs_of
    from meshshard_train.prediction_inputs import features_of, meshes_of, source_names
    from meshshard_train.state import BEST

    if jobs == 0:
        raise UsageError("--jobs is the number of processes, or -1 for one a core; it cannot be 0")
    best = checkpoint.load(run if run.is_file() else run / BEST)
    where, meshes = choose_device(device), meshes_of(mesh, out)
    rounds = known_rounds(best, run) if vote is None else vote
    if rounds is None:
        typer.echo(f"{run} does not say how many rounds of voting to take: none; or say --vote N", err=True)
    outputs = outputs_of(best, rounds or 0, pictures=not no_pictures)
    places = {source: (meshes[name], out / name) for source, name in source_names(meshes).items()}
    table: list[dict[str, Any]] = []
    with tempfile.TemporaryDirectory() as scratch:
        dataset = features_of(meshes, best.recipe, Path(scratch), jobs)
        with mesh_bar(len(dataset)) as done:
            for found in label_meshes(best, outputs, dataset, places, where, jobs):
                table.append(found)
                if not as_json:
                    typer.echo(_line(found))
                done()
        rejected = (*dataset.index.refused, *dataset.index.failed)
    for entry in rejected:
        source = str(places[entry.source][0])
        message = entry.message.replace(entry.source, source)
        table.append({"source": source, "files": [], "refused": {"code": entry.code, "message": message}})
        typer.echo(f"refused  {message}", err=True)
    if as_json:
        typer.echo(to_json(table))
    for note in {found["note"] for found in table if "note" in found}:
        typer.echo(f"note: in .seg and .confidence {note}", err=True)
    raise typer.Exit(1 if rejected else 0)


PLURAL = {"face": "faces", "vertex": "vertices"}


def _line(found: dict[str, Any]) -> str:
    """What is said of a mesh: its classes, and the files with their endings."""
    if "class" in found:
        said = f"{found['class']} ({100 * found['probability']:.1f} %)"
    else:
        counts = {name: count for name, count in found["counts"].items() if count}
        parts = ", ".join(f"{name} {count}" for name, count in counts.items())
        said = f"{PLURAL[found['labelled']]} of {parts} (confidence {100 * found['confidence']:.1f} %)"
    first, *others = found["files"]
    return f"{found['source']}: {said} -> {', '.join([first, *(Path(other).suffix for other in others)])}"
