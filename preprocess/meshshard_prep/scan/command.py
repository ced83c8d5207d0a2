"""The verb `scan`."""

import shlex
from pathlib import Path
from typing import Annotated

import typer

from meshshard.commands import AsJson
from meshshard.plain import to_json
from meshshard.remote import local_folder, to_path


def scan(
    folder: Annotated[Path, typer.Argument(help="Folder or URL of meshes and what belongs to them.", parser=to_path)],
    out: Annotated[
        Path | None,
        typer.Option(help="The TOML file to write (default: NAME.toml).", parser=local_folder, metavar="FILE"),
    ] = None,
    name: Annotated[str, typer.Option(help="Name of the data set (default: the folder's).")] = "",
    force: Annotated[bool, typer.Option("--force", help="Write over a file that is there.")] = False,
    as_json: AsJson = False,
) -> None:
    """Look at a folder: which meshes, labels, classes and splits it holds. Write a small TOML file that says so.

    The file works as it is; a line that begins with # EDIT: asks what the data leaves open. Exit status 0, or 2 where
    there is no mesh.

    Examples: meshshard scan my_folder

    meshshard scan my_folder --out bones.toml --name bones
    """
    from meshshard.errors import UsageError
    from meshshard.files import publish
    from meshshard_prep.progress import progress
    from meshshard_prep.scan.look import look
    from meshshard_prep.scan.reading import read_findings
    from meshshard_prep.scan.report import as_table, as_text
    from meshshard_prep.scan.write import edits_of, name_of, seen_from, toml_of

    name = name_of(name or folder.resolve().name)
    file = out or Path(f"{name}.toml")
    if file.exists() and not force:
        raise UsageError(f"{file} is there; give another name with --out, or write over it with --force")
    with progress("scan") as tell:
        findings = look(folder, lambda _, done, of: tell(done, of, 0))
    reading = read_findings(findings)
    text = toml_of(findings, reading, name, seen_from(file.parent, folder))
    file.parent.mkdir(parents=True, exist_ok=True)
    publish(file, text.encode(), durable=False)
    edits = edits_of(text)
    then = f"meshshard features {shlex.quote(str(file))}"
    if as_json:
        table = as_table(findings, reading)
        typer.echo(to_json(table | {"wrote": str(file), "edits": [list(edit) for edit in edits], "next": then}))
        return
    typer.echo(as_text(findings, reading))
    for number, what in edits:
        typer.echo(f"{'look at':12} {file}:{number}: {what}")
    typer.echo(f"{'wrote':12} {file}\n{'next':12} {then}")
