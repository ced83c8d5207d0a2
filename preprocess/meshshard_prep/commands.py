"""The verbs of the offline half: datasets, features, bench."""

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Protocol

import typer

from meshshard.commands import FEATURES, AsJson
from meshshard.plain import to_json
from meshshard.remote import local_folder, to_path

if TYPE_CHECKING:
    from meshshard.recipe import Recipe
    from meshshard_prep.run import Report


class Tell(Protocol):
    """Told after each mesh that was computed: how many are done, of how many, and how many are not stored."""

    def __call__(self, done: int, total: int, rejected: int) -> None: ...


def datasets(as_json: AsJson = False) -> None:
    """The data sets known by name: what they are, where they come from, their licences.

    Example: meshshard datasets
    """
    from meshshard_prep.datasets import ADAPTERS  # plyfile and numpy stay out of --help

    if as_json:
        known = {
            a.name: {"summary": a.summary, "licence": a.licence, "citation": a.citation, "origin": a.origin}
            for a in ADAPTERS.values()
        }
        typer.echo(to_json(known))
        return
    for adapter in ADAPTERS.values():
        typer.echo(f"{adapter.name:13} {adapter.summary}\n{'':13} from {adapter.origin}")
        typer.echo(f"{'':13} licence: {adapter.licence}\n{'':13} cite: {adapter.citation}\n")


def features(
    dataset: Annotated[
        str, typer.Argument(help="Name of a data set, folder or URL of meshes, .toml file, or one mesh file.")
    ],
    raw: Annotated[
        Path | None,
        typer.Option(help="Folder or URL of the raw files [default: data/raw/NAME].", parser=to_path, metavar="DIR"),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder for the shards [default: data/features/NAME/RECIPE].", parser=local_folder, metavar="DIR"
        ),
    ] = None,
    jobs: Annotated[int, typer.Option(help="Worker processes; -1 for one a core.")] = -1,
    recipe: Annotated[str, typer.Option(help="paper, official, or a .json file with a recipe.")] = "paper",
    val_fraction: Annotated[
        float, typer.Option(help="Share of train that becomes validation if none is shipped.")
    ] = 0.15,
    split_seed: Annotated[int, typer.Option(help="Seed of that draw.", min=0)] = 0,
    components: Annotated[
        str | None, typer.Option(help="Pieces of a mesh: separate, or bridged by weak links.")
    ] = None,
    spectrum: Annotated[int, typer.Option(help="Store that many of the lowest eigenpairs too.", min=0)] = 0,
    no_labels: Annotated[bool, typer.Option("--no-labels", help="Ignore labels, splits and classes.")] = False,
) -> None:
    """Compute the features of a data set's meshes and store them as shards. Run again, it computes what is new.

    A mesh that cannot be used is refused with the reason and the others are stored: exit status 0 when all are
    stored, 1 when some are not, 2 when nothing could be done.

    Examples: meshshard features minicoseg

    meshshard features human_seg --raw ~/meshes/human_seg --jobs 8

    meshshard features my_folder_of_meshes --out shards

    meshshard features s3://bucket/meshes
    """
    from meshshard.errors import UsageError
    from meshshard.recipe import find_recipe
    from meshshard_prep.datasets import read_dataset
    from meshshard_prep.datasets.layout import without_labels
    from meshshard_prep.run import run

    if not 0 <= val_fraction < 1:
        raise UsageError(f"--val-fraction is at least 0 and below 1, not {val_fraction}")
    if jobs == 0:
        raise UsageError("--jobs is the number of workers, or -1 for one a core; it cannot be 0")
    settings = _with_options(find_recipe(recipe), components, spectrum)
    raw_dataset = read_dataset(dataset, raw, lambda text: typer.echo(text, err=True))
    if no_labels:
        raw_dataset = without_labels(raw_dataset)
    folder = out or FEATURES / raw_dataset.name / settings.name
    try:
        with _progress(raw_dataset.name) as tell:
            report = run(
                raw_dataset,
                folder,
                settings,
                jobs=jobs,
                val_fraction=val_fraction,
                split_seed=split_seed,
                progress=tell,
            )
    except KeyboardInterrupt:
        raise UsageError("stopped; what is done is kept: the same command goes on from there") from None
    _print_report(report, folder)
    raise typer.Exit(0 if report.ok else 1)


def _with_options(recipe: "Recipe", components: str | None, spectrum: int) -> "Recipe":
    """The recipe with what the options change, under a name of its own."""
    from dataclasses import replace

    if components is not None and components != recipe.components:
        recipe = replace(recipe, components=components, name=f"{recipe.name}-{components}")
    if spectrum:
        recipe = replace(recipe, spectrum=spectrum, name=f"{recipe.name}-spectrum{spectrum}")
    return recipe


def bench(
    out: Annotated[Path, typer.Option(help="Folder for the table and the plot.")] = Path("docs/benchmarks"),
    quick: Annotated[bool, typer.Option("--quick", help="Small meshes only: seconds, not minutes.")] = False,
    as_json: AsJson = False,
) -> None:
    """Measure the preparation beside the published way, in one run, and write a table and a plot.

    Example: meshshard bench --quick --out /tmp/bench
    """
    from importlib.metadata import version

    from threadpoolctl import threadpool_limits

    from meshshard_prep.bench import measure, report

    sizes = {252: 3} if quick else measure.SIZES
    libraries = ("numpy", "scipy", "numba", "potpourri3d", "robust-laplacian")
    figures: dict[str, Any] = {
        "processor": report.processor(),
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
    if not quick:
        typer.echo("a million faces: minutes", err=True)
        figures["large"] = measure.large_mesh()
    report.write(out, figures)
    typer.echo(to_json(figures) if as_json else report.page(figures))


def _print_report(report: "Report", folder: Path) -> None:
    index = report.index
    for word, entries in (("refused", index.refused), ("failed", index.failed)):
        for entry in entries:
            typer.echo(f"{word}  {entry.message}")
    typer.echo(
        f"{index.dataset}: {len(index.ids)} stored ({report.computed} new), {len(index.refused)} refused, "
        f"{len(index.failed)} failed, in {report.seconds:.1f} s -> {folder}"
    )


@contextmanager
def _progress(name: str) -> Iterator[Tell]:
    """A bar on a terminal, a line every ten seconds elsewhere."""
    if not sys.stderr.isatty():
        yield _Lines(name)
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[rate]:.1f} meshes/s"),
        TimeRemainingColumn(),
        TextColumn("{task.fields[rejected]} not stored"),
    )
    with Progress(*columns, console=Console(stderr=True)) as bar:
        task = bar.add_task(name, total=None, rejected=0, rate=0.0)
        start = time.perf_counter()

        def tell(done: int, total: int, rejected: int) -> None:
            rate = done / (time.perf_counter() - start)
            bar.update(task, completed=done, total=total, rejected=rejected, rate=rate)

        yield tell


class _Lines:
    """Progress for logs."""

    def __init__(self, name: str) -> None:
        self.name, self.start = name, time.perf_counter()
        self.next = self.start + 10

    def __call__(self, done: int, total: int, rejected: int) -> None:
        now = time.perf_counter()
        if now >= self.next:
            self.next = now + 10
            rate = done / (now - self.start)
            typer.echo(
                f"{self.name}: {done} of {total}, {rate:.1f} meshes/s, {(total - done) / rate:.0f} s left, "
                f"{rejected} not stored",
                err=True,
            )
