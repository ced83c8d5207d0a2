"""The verbs of the offline half: datasets, features, status, doctor."""

import sys
from math import ceil
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from meshshard.commands import FEATURES, AsJson, locate
from meshshard.plain import print_table, to_json
from meshshard.remote import local_folder, to_path

if TYPE_CHECKING:
    from meshshard.recipe import Recipe
    from meshshard_prep.datasets.layout import RawDataset
    from meshshard_prep.run import Report


def datasets(as_json: AsJson = False) -> None:
    """The data sets known by name, by task: what they are, where they come from, their licences.

    Example: meshshard datasets
    """
    from meshshard_prep.datasets import ADAPTERS  # numpy stays out of --help
    from meshshard_prep.datasets.listing import as_table, as_text

    adapters = list(ADAPTERS.values())
    typer.echo(to_json(as_table(adapters)) if as_json else as_text(adapters))


Raw = Annotated[
    Path | None,
    typer.Option(help="Folder or URL of the raw files (default: data/raw/NAME).", parser=to_path, metavar="DIR"),
]
Out = Annotated[
    Path | None,
    typer.Option(
        help="Folder of the shards (default: data/features/NAME/RECIPE).", parser=local_folder, metavar="DIR"
    ),
]
RecipeName = Annotated[str, typer.Option(help="paper, best, official, or a .json file with a recipe.")]
Components = Annotated[str | None, typer.Option(help="Pieces of a mesh: separate, or bridged by weak links.")]
SpectrumSize = Annotated[int, typer.Option(help="Store that many of the lowest eigenpairs too.", min=0)]
Step = Annotated[
    list[str] | None,
    typer.Option(help="Change the meshes: weld, largest_component, orient. Again for several, in that order."),
]
Simplify = Annotated[
    int,
    typer.Option(help="Collapse edges down to that many faces; 0 leaves meshes as they are.", min=0),
]
SplitSeed = Annotated[int, typer.Option(help="Seed of all splits that are drawn.", min=0)]
Fold = Annotated[int, typer.Option(help="Fold to test on, where a data set has folds.", min=0)]
NoLabels = Annotated[bool, typer.Option("--no-labels", help="Ignore labels, splits and classes.")]


def features(
    dataset: Annotated[
        str, typer.Argument(help="Name of a data set, folder or URL of meshes, .toml file, or one mesh file.")
    ],
    raw: Raw = None,
    out: Out = None,
    jobs: Annotated[int, typer.Option(help="Worker processes; -1 for one a core.")] = -1,
    recipe: RecipeName = "paper",
    val_fraction: Annotated[
        float, typer.Option(help="Share of train that becomes validation if none is shipped.")
    ] = 0.15,
    split_seed: SplitSeed = 0,
    fold: Fold = 0,
    train_fraction: Annotated[
        float, typer.Option(help="Share of train to keep, for few-shot learning: nested by seed.")
    ] = 1.0,
    components: Components = None,
    spectrum: SpectrumSize = 0,
    step: Step = None,
    simplify: Simplify = 0,
    deformed: Annotated[
        int, typer.Option(help="Store so many deformed copies of each training mesh too.", min=0, max=100)
    ] = 0,
    no_labels: NoLabels = False,
    time_limit: Annotated[float, typer.Option(help="Seconds a mesh may take; 0 for no limit.", min=0)] = 600,
    memory_limit: Annotated[float, typer.Option(help="GB a mesh may take; 0 for no limit.", min=0)] = 8,
    backend: Annotated[str, typer.Option(help="Where workers are: loky (this machine), dask, or ray.")] = "loky",
    address: Annotated[
        str | None, typer.Option(help="Of dask's scheduler, as tcp://HOST:8786, or of ray, as HOST:6379.")
    ] = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Only tell what would be done, and what it takes.")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Compute the features of a data set's meshes and store them as shards. Run again, it computes what is new.

    A mesh that cannot be used is refused with the reason and the others are stored: exit status 0 when all are
    stored, 1 when some are not, 2 when nothing could be done.

    Examples: meshshard features minicoseg

    meshshard features human_seg --raw ~/meshes/human_seg --jobs 8

    meshshard features my_folder_of_meshes --out shards --dry-run

    meshshard features my_folder_of_meshes --step weld --step orient --simplify 750

    meshshard features s3://bucket/meshes
    """
    from meshshard.errors import UsageError
    from meshshard.recipe import find_recipe
    from meshshard_prep.datasets.copies import with_copies
    from meshshard_prep.engines import find_engine
    from meshshard_prep.isolation import Limits
    from meshshard_prep.progress import progress
    from meshshard_prep.run import run

    if not 0 <= val_fraction < 1:
        raise UsageError(f"--val-fraction is at least 0 and below 1, not {val_fraction}")
    if not 0 < train_fraction <= 1:
        raise UsageError(f"--train-fraction is above 0 and at most 1, not {train_fraction}")
    if not memory_limit <= 10**6:
        raise UsageError(f"--memory-limit is a number of GB, at most a million, not {memory_limit}")
    if jobs == 0:
        raise UsageError("--jobs is the number of workers, or -1 for one a core; it cannot be 0")
    engine = find_engine(backend, address, jobs)
    settings = _with_options(find_recipe(recipe), components, spectrum, step, simplify)
    raw_dataset = _raw_dataset(dataset, raw, no_labels, make=not dry_run, seed=split_seed, fold=fold)
    if train_fraction < 1 and "train" not in raw_dataset.splits.values():
        raise UsageError(
            f"--train-fraction is a share of train, and {raw_dataset.name} has no such split; leave it out"
        )
    raw_dataset = with_copies(raw_dataset, deformed)
    for note in raw_dataset.notes:
        typer.echo(f"note: {note}", err=True)
    folder = out or FEATURES / raw_dataset.name / settings.name
    if dry_run:
        _tell_plan(raw_dataset, folder, settings, jobs if backend == "loky" else 1, as_json)
        return
    try:
        with progress(raw_dataset.name) as tell:
            report = run(
                raw_dataset,
                folder,
                settings,
                engine=engine,
                limits=Limits(seconds=time_limit or None, memory=ceil(memory_limit * 1e9) or None),
                val_fraction=val_fraction,
                split_seed=split_seed,
                train_fraction=train_fraction,
                progress=tell,
            )
    except KeyboardInterrupt:
        raise UsageError("stopped; what is done is kept: the same command goes on from there") from None
    _print_report(report, folder, as_json)
    raise typer.Exit(0 if report.ok else 1)


def status(
    dataset: Annotated[str, typer.Argument(help="As for `info` or for `features`: a folder, a name, a .toml file.")],
    raw: Raw = None,
    out: Out = None,
    recipe: RecipeName = "paper",
    components: Components = None,
    spectrum: SpectrumSize = 0,
    step: Step = None,
    simplify: Simplify = 0,
    no_labels: NoLabels = False,
    as_json: AsJson = False,
) -> None:
    """What is stored, refused and failed; and, where the raw files are, what is fresh, what is stale and why.

    Examples: meshshard status minicoseg --json

    meshshard status shards --raw ~/meshes/human_seg
    """
    from meshshard.copies import most_copies
    from meshshard.errors import UsageError
    from meshshard.index import INDEX_NAME, read_index
    from meshshard.recipe import find_recipe
    from meshshard_prep import status as tables
    from meshshard_prep.datasets import ADAPTERS
    from meshshard_prep.datasets.copies import with_copies

    folder, missing = to_path(dataset), ""
    if dataset not in ADAPTERS and not folder.exists():
        folder = locate(dataset)  # a name that a .toml file gave
    raw_dataset: RawDataset | None = None
    if (folder / INDEX_NAME).is_file():
        index = read_index(folder)
        settings, copies = index.recipe, most_copies(index.ids)
        try:
            if index.dataset in ADAPTERS:
                raw_dataset = with_copies(_raw_dataset(index.dataset, raw, no_labels, make=False), copies)
            else:
                described = Path(f"{index.dataset}.toml")  # as `scan` calls it
                named = raw or (described if described.is_file() else index.dataset)
                raw_dataset = with_copies(_raw_dataset(str(named), None, no_labels, make=False), copies)
        except UsageError as error:
            missing = f"what is stale cannot be told without the raw files; say where they are with --raw. {error}"
    else:
        settings = _with_options(find_recipe(recipe), components, spectrum, step, simplify)
        raw_dataset = _raw_dataset(dataset, raw, no_labels, make=False)
        folder = out or FEATURES / raw_dataset.name / settings.name
    table = tables.stored(folder) | {"plan": raw_dataset and tables.planned(raw_dataset, folder, settings)}
    typer.echo(to_json(table) if as_json else tables.as_text(table, missing))


def _raw_dataset(
    dataset: str, raw: Path | None, no_labels: bool, make: bool = True, seed: int = 0, fold: int = 0
) -> "RawDataset":
    from meshshard_prep.datasets import Draw, read_dataset
    from meshshard_prep.datasets.layout import without_labels

    draw = Draw(seed=seed, fold=fold)
    found = read_dataset(dataset, raw, lambda text: typer.echo(text, err=True), make=make, draw=draw)
    return without_labels(found) if no_labels else found


def _tell_plan(dataset: "RawDataset", folder: Path, recipe: "Recipe", jobs: int, as_json: bool) -> None:
    from meshshard_prep import status as tables

    table = tables.planned(dataset, folder, recipe, workers=jobs)
    typer.echo(to_json(table) if as_json else tables.plan_as_text(table))


def doctor(
    meshes: Annotated[list[Path], typer.Argument(help="Mesh files, or folders of them.")],
    recipe: Annotated[str, typer.Option(help="paper, best, official, or a .json file with a recipe.")] = "paper",
    as_json: AsJson = False,
) -> None:
    """Show what a mesh has, what is repaired on its working copy, and whether it is usable or why not.

    Exit status 0 when all are usable, 1 when some are refused, 2 when nothing could be done.

    Examples: meshshard doctor chair.obj

    meshshard doctor my_folder_of_meshes --json
    """
    from meshshard.recipe import find_recipe
    from meshshard_prep.doctor import entries_at, examine
    from meshshard_prep.doctor_report import oddities, rows, verdict
    from meshshard_prep.isolation import Limits
    from meshshard_prep.progress import progress

    settings = find_recipe(recipe)
    entries = [entry for path in meshes for entry in entries_at(path)]
    diagnoses, refused = [], 0
    with progress("doctor") as tell:
        for done, entry in enumerate(entries, start=1):
            diagnoses.append(examine(entry, settings, Limits()))
            refused += diagnoses[-1].refusal is not None
            tell(done, len(entries), refused)
    if as_json:
        usable = len(diagnoses) - refused
        found = [diagnosis.table() for diagnosis in diagnoses]
        typer.echo(to_json({"usable": usable, "refused": refused, "meshes": found}))
    elif len(diagnoses) == 1:
        print_table([], rows(diagnoses[0]))
    else:
        print_table(
            ["mesh", "verdict", "odd"],
            [(diagnosis.source, verdict(diagnosis), oddities(diagnosis)) for diagnosis in diagnoses],
        )
        typer.echo(f"{len(diagnoses) - refused} usable, {refused} refused")
    raise typer.Exit(1 if refused else 0)


def _with_options(
    recipe: "Recipe", components: str | None, spectrum: int, steps: list[str] | None, simplify: int
) -> "Recipe":
    """The recipe with what the options change, under a name of its own."""
    from dataclasses import replace

    if components is not None and components != recipe.components:
        recipe = replace(recipe, components=components, name=f"{recipe.name}-{components}")
    if spectrum:
        recipe = replace(recipe, spectrum=spectrum, name=f"{recipe.name}-spectrum{spectrum}")
    if steps:
        recipe = replace(recipe, steps=tuple(steps), name="-".join([recipe.name, *steps]))
    if simplify:
        recipe = replace(recipe, simplify=simplify, name=f"{recipe.name}-simplify{simplify}")
    return recipe


def _print_report(report: "Report", folder: Path, as_json: bool) -> None:
    from meshshard_prep.status import stored

    if as_json:
        seconds = {"seconds": report.seconds, "mesh_seconds": report.mesh_seconds, "removed": list(report.removed)}
        typer.echo(to_json(stored(folder) | {"computed": report.computed} | seconds))
        return
    index = report.index
    for word, entries in (("refused", index.refused), ("failed", index.failed)):
        for entry in entries:
            typer.echo(f"{word}  {entry.message}")
    typer.echo(
        f"{index.dataset}: {len(index.ids)} stored ({report.computed} new), {len(index.refused)} refused, "
        f"{len(index.failed)} failed, in {report.seconds:.1f} s -> {folder}"
    )
    if report.removed:
        typer.echo(f"{len(report.removed)} removed, for there is no raw file any more, as {report.removed[0]}")
    if sys.stdout.isatty():
        typer.echo(f"what is in it: meshshard info {folder}")
