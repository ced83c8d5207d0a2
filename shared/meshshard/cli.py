"""The program `meshshard`. Verbs are found through the entry points `meshshard.commands`, each loaded when called."""

import contextlib
import sys
from importlib.metadata import entry_points
from typing import Any

import typer
from rich.console import Console
from typer.core import TyperGroup

from meshshard.errors import MeshshardError

VERBS = (
    "datasets",
    "scan",
    "fetch",
    "features",
    "doctor",
    "info",
    "status",
    "verify",
    "train",
    "evaluate",
    "predict",
    "view",
    "report",
    "gallery",
    "export",
    "export-model",
    "generate",
    "bench",
    "bench-train",
    "reproduce",
)
"""Order in `--help`; verbs that others add follow."""

EXTRAS = {
    "preprocess": (
        "igl",
        "scipy",
        "joblib",
        "robust_laplacian",
        "skimage",
        "threadpoolctl",
        "numba",
        "platformdirs",
        "pymetis",
        "pooch",
        "requests",
    ),
    "simplify": ("pymeshlab",),
    "bench": ("potpourri3d",),
    "distributed": ("dask", "distributed", "ray"),
    "remote": ("fsspec", "s3fs"),
    "pictures": ("embreex", "jinja2", "PIL"),
    "view": ("trimesh", "viser"),
    "train": ("torch", "safetensors", "matplotlib", "tensorboard"),
    "pyg": ("torch_geometric",),
    "onnx": ("onnx", "onnxscript", "onnxruntime"),
}
"""Extra -> top-level modules that it brings."""


class _Verbs(TyperGroup):
    """Looks verbs up by name, so that asking for one imports that one only."""

    def list_commands(self, ctx: Any) -> list[str]:  # noqa: ARG002  click's signature
        found = {entry.name for entry in entry_points(group="meshshard.commands")}
        return [name for name in VERBS if name in found] + sorted(found - set(VERBS))

    def get_command(self, ctx: Any, cmd_name: str) -> Any:  # noqa: ARG002  click's signature
        for entry in entry_points(group="meshshard.commands", name=cmd_name):
            app = typer.Typer(add_completion=False)
            app.command(cmd_name)(entry.load())
            return typer.main.get_command(app)
        return None


app = typer.Typer(cls=_Verbs, no_args_is_help=True, rich_markup_mode="markdown")


@app.callback()
def program() -> None:
    """Raw triangle meshes to verified feature shards, and networks trained on them.

    Start with: meshshard features minicoseg, then: meshshard train minicoseg
    """


def main() -> None:
    """Run the program; an expected error is a sentence on standard error and exit status 2."""
    _allow_open_files()
    try:
        app()
    except MeshshardError as error:
        _fail(str(error))
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""
        _fail(f"{where}{error.strerror or error}")
    except ModuleNotFoundError as error:
        module = (error.name or "").split(".")[0]
        extra = next((extra for extra, modules in EXTRAS.items() if module in modules), None)
        if extra is None:
            raise
        _fail(f"this command needs {module}, which comes with: pip install 'meshshard[{extra}]'")


def _allow_open_files() -> None:
    """As many as the system permits: a data set holds one for each of its shards."""
    if sys.platform != "win32":
        import resource

        hard = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
        with contextlib.suppress(ValueError, OSError):  # not on every system up to there
            resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))


def _fail(message: str) -> None:
    Console(stderr=True, soft_wrap=True, highlight=False).print(f"[bold red]error:[/] {_plain(message)}")
    sys.exit(2)


def _plain(message: str) -> str:
    return message.replace("[", "\\[")
