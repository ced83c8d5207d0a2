"""Which files are meshes."""

from collections.abc import Iterator
from pathlib import Path

MESH_SUFFIXES = (".obj", ".off", ".ply")


def mesh_files_below(folder: Path) -> Iterator[Path]:
    """What is no folder and ends like a mesh. A folder that cannot be listed is an OSError: it may hold meshes."""
    for path in folder.iterdir():
        if path.name.startswith("."):
            continue
        if path.is_dir():
            if not path.is_symlink():
                yield from mesh_files_below(path)
        elif path.suffix.lower() in MESH_SUFFIXES:
            yield path
