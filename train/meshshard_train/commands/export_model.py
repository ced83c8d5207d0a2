"""meshshard export-model: the network of a run as a file for other programs."""

from pathlib import Path
from typing import Annotated

import typer

from meshshard.commands import AsJson
from meshshard.plain import to_json
from meshshard_train.commands.shared import Run


def export_model(
    run: Run,
    to: Annotated[str, typer.Option(help="Format: onnx, or torch (a program of torch.export, .pt2).")],
    out: Annotated[Path, typer.Option(help="The file to write.", metavar="FILE")],
    as_json: AsJson = False,
) -> None:
    """Write the network of a run's best epoch as a file for other programs.

    It takes the stored features of one mesh, of any size, scales them itself, and gives the probability of every
    class for each face, each vertex, or the mesh. It is run, and held against the network, before it is published.

    Example: meshshard export-model runs/minicoseg --to onnx --out minicoseg.onnx
    """
    from meshshard_train import checkpoint
    from meshshard_train.model_files import write_model
    from meshshard_train.state import BEST

    report = write_model(checkpoint.load(run / BEST), to, out)
    if as_json:
        typer.echo(to_json(report))
        return
    typer.echo(f"{out}: {report['bytes']:,} bytes")
    typer.echo(f"takes {', '.join(report['inputs'])}; gives {' '.join(report['output'].values())}")
    sizes = ", ".join(map(str, report["checked"]))
    typer.echo(
        f"differs from the network by {report['largest_difference']:.1e} at most, on meshes of {sizes} vertices"
    )
