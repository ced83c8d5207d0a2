"""The verb `bench`."""

from pathlib import Path
from typing import Annotated, Any

import typer

from meshshard.commands import AsJson
from meshshard.plain import to_json


def bench(
    out: Annotated[Path, typer.Option(help="Folder for the table and the plot.")] = Path("docs/benchmarks"),
    quick: Annotated[bool, typer.Option("--quick", help="Small meshes only: seconds, not minutes.")] = False,
    meshes: Annotated[
        int, typer.Option(help="Instead: a run over that many small meshes, on two workers.", min=0)
    ] = 0,
    as_json: AsJson = False,
) -> None:
    """Measure the preparation beside the published way, and reading beside a bare memory map: tables and a plot.

    Examples: meshshard bench --quick --out /tmp/bench

    meshshard bench --meshes 12000
    """
    if meshes:
        from meshshard_prep.bench.many import many_meshes

        typer.echo(to_json(many_meshes(meshes)))
        return
    from importlib.metadata import version

    from threadpoolctl import threadpool_limits

    from meshshard.machine import processor
    from meshshard_prep.bench import measure, report, streaming

    sizes = {252: 3} if quick else measure.SIZES
    libraries = ("numpy", "scipy", "numba", "potpourri3d", "robust-laplacian")
    figures: dict[str, Any] = {
        "processor": processor(),
        "versions": {name: version(name) for name in libraries},
        "few_pairs": measure.FEW_PAIRS,
        "full_up_to": measure.FULL_UP_TO,
    }
    with threadpool_limits(1):
        for kind, rows in (("hks", measure.hks_rows(sizes)), ("path", measure.path_rows(sizes))):
            figures[kind] = []
            for row in rows:
                figures[kind].append(row)
                typer.echo(f"{kind}: {to_json(row)}", err=True)
        figures["parts"] = measure.parts()
        figures["workers"] = measure.worker_row()
        machine = {name: figures[name] for name in ("processor", "versions")}
        figures["streaming"] = machine | (streaming.streaming(meshes=32) if quick else streaming.streaming())
    if not quick:
        typer.echo("a million faces: minutes", err=True)
        figures["large"] = measure.large_mesh()
    reading = figures.pop("streaming")
    report.write(out, figures)
    streaming.write(out, reading)
    typer.echo(
        to_json(figures | {"streaming": reading}) if as_json else report.page(figures) + streaming.page(reading)
    )
