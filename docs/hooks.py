"""What mkdocs.yml cannot say: folders in the navigation, and pages that are made when the site is built."""

import re
from pathlib import Path
from typing import Any

import typer
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from typer.cli import get_docs_for_click

from meshshard.cli import app

ROOT = Path(__file__).parents[1]


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Replace each folder of the navigation by its pages."""
    config.nav = [_with_pages(entry, Path(config.docs_dir)) for entry in config.nav or []]
    return config


def _with_pages(entry: Any, docs: Path) -> Any:
    if not (isinstance(entry, dict) and isinstance(pages := next(iter(entry.values())), list)):
        return entry
    found = []
    for page in pages:
        folder = isinstance(page, str) and page.endswith("/")
        found += sorted(str(path.relative_to(docs)) for path in (docs / page).rglob("*.md")) if folder else [page]
    return {next(iter(entry)): found}


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add what the commands say about themselves, and the changelog."""
    command = typer.main.get_command(app)
    text = get_docs_for_click(
        obj=command, ctx=typer.Context(command), name="meshshard", title="Help of every command"
    )
    text = re.sub(r"^\* `([a-z][a-z-]*)`: .*$", r"* [`\1`](#meshshard-\1)", text, flags=re.M)  # cut off by typer
    files.append(File.generated(config, "help.md", content=text))
    files.append(File.generated(config, "changelog.md", abs_src_path=str(ROOT / "CHANGELOG.md")))
    return files


def on_post_page(output: str, **_: Any) -> str:
    """Name the dialog of the search, for those who do not see it."""
    return _with_named_search(output)


def on_post_template(output_content: str, **_: Any) -> str:
    """The same on the page of what is not found."""
    return _with_named_search(output_content)


def _with_named_search(output: str) -> str:
    return output.replace(
        'data-md-component="search" role="dialog"', 'data-md-component="search" role="dialog" aria-label="Search"'
    )
