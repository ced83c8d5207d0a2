"""meshshard predict: classes for mesh files that were never in a data set."""

import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Annotated

import typer

from meshshard.errors import UsageError
from meshshard_train.commands.shared import Device, Run, wait_quietly


def predict(
    run: Run,
    mesh: Annotated[list[Path], typer.Argument(help="Mesh files, or folders of them.")],
    out: Annotated[Path, typer.Option(help="Folder for the results.")] = Path("predictions"),
    device: Device = "auto",
) -> None:
    """Label meshes that were never in a data set: raw files in; coloured PLY, PNG and a label file each out.

    Features are computed with the recipe stored in the checkpoint. Exit status 1 when a mesh was refused.

    Example: meshshard predict runs/minicoseg chair.obj --out labelled
    """
    wait_quietly()
    from meshshard import open_dataset
    from meshshard_train import checkpoint
    from meshshard_train.device import choose_device
    from meshshard_train.prediction_files import write_predictions
    from meshshard_train.state import BEST

    best = checkpoint.load(run / BEST)
    where = choose_device(device)
    for path in mesh:
        if not path.exists():
            raise UsageError(f"{path}: no such mesh file or folder")
    names = [path.stem for path in mesh]
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise UsageError(f"two meshes called {twice[0]} would write the same files; give them different --out")
    refused = False
    for path in mesh:
        with tempfile.TemporaryDirectory() as scratch:
            recipe = Path(scratch) / "recipe.json"
            recipe.write_text(best.recipe.to_json())
            # The halves meet in files: the mesh becomes a shard, made by the program that makes all shards.
            command = [sys.executable, "-m", "meshshard", "features", str(path.resolve()), "--no-labels"]
            command += ["--recipe", str(recipe), "--out", scratch, "--jobs", "1" if path.is_file() else "-1"]
            done = subprocess.run(command, stdout=subprocess.PIPE, check=False)
            if done.returncode > 1:
                raise typer.Exit(done.returncode)  # it has said why
            dataset = open_dataset(scratch)
            for line in write_predictions(best, dataset, out, where):
                typer.echo(line)
            for entry in (*dataset.index.refused, *dataset.index.failed):
                refused = True
                typer.echo(f"refused  {entry.message}", err=True)
    raise typer.Exit(1 if refused else 0)
