"""From mesh files that were never in a data set to their features."""

import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from meshshard import Dataset, UsageError, open_dataset
from meshshard.mesh_files import MESH_SUFFIXES, mesh_files_below
from meshshard.recipe import Recipe


def meshes_of(given: Sequence[Path], out: Path) -> dict[str, Path]:
    """Name of the results below `out` -> mesh file, for each file given or below a folder given, once.

    A name is that of the file, below a folder given its path in there; where that is the same for two, the path below
    the folder that all have in common. The ending is left out, unless two differ in it alone: then none is. What lies
    in an `out` below a folder given is not looked for. UsageError: nothing there, no mesh in a folder, or results
    beside a mesh.
    """
    as_given: dict[Path, Path] = {}
    names: dict[Path, Path] = {}
    results = _absolute(out)
    for path in given:
        if not path.exists():
            raise UsageError(f"{path}: no such mesh file or folder")
        files = sorted(mesh_files_below(path)) if path.is_dir() else [path]
        if _absolute(path) in results.parents:
            files = [file for file in files if not _absolute(file).is_relative_to(results)]
        if not files:
            ends = ", ".join(MESH_SUFFIXES)
            raise UsageError(f"{path} holds no mesh: no file outside {out} ends in {ends}")
        for file in files:
            as_given.setdefault(_absolute(file), file)
            names.setdefault(_absolute(file), file.relative_to(path if path.is_dir() else path.parent))
    if len(set(names.values())) < len(names):
        common = os.path.commonpath([file.parent for file in names])
        names = {file: file.relative_to(common) for file in names}
    if len({name.with_suffix("") for name in names.values()}) == len(names):
        names = {file: name.with_suffix("") for file, name in names.items()}
    for file, name in names.items():
        if (results / name).parent.resolve() == file.parent.resolve():
            raise UsageError(
                f"--out {out}: results would be written beside the mesh {as_given[file]}, over files of its name; "
                "choose another folder"
            )
    return {name.as_posix(): as_given[file] for file, name in names.items()}


def _absolute(path: Path) -> Path:
    """Without the dots in it; links are not followed, for two of them may be two meshes."""
    return Path(os.path.abspath(path))  # noqa: PTH100  resolve() would follow links


def features_of(meshes: Mapping[str, Path], recipe: Recipe, scratch: Path, jobs: int) -> Dataset:
    """Features of all of these mesh files: shards in the folder `scratch`. `source_names` tells which is whose.

    The halves meet in files: the meshes become shards by the program that makes all shards, called once. UsageError:
    it could not do its work; it has said why.
    """
    folder = scratch / "meshes"
    folder.mkdir()
    for source, name in source_names(meshes).items():
        (folder / source).symlink_to(_absolute(meshes[name]))
    return computed(folder, recipe, scratch, jobs)


def computed(meshes: Path, recipe: Recipe, scratch: Path, jobs: int) -> Dataset:
    """Features of a mesh file, or of those in a folder, without labels, as `features_of`."""
    settings, shards = scratch / "recipe.json", scratch / "shards"
    settings.write_text(recipe.to_json())
    command = [sys.executable, "-m", "meshshard", "features", str(meshes), "--no-labels"]
    command += ["--recipe", str(settings), "--out", str(shards), "--jobs", str(jobs)]
    if subprocess.run(command, stdout=subprocess.PIPE, check=False).returncode > 1:
        raise UsageError("features could not be computed, for the reason above")
    return open_dataset(shards)


def source_names(meshes: Mapping[str, Path]) -> dict[str, str]:
    """`source` of a sample of `features_of` -> name in `meshes`, in order. Files are linked by their numbers, so that
    neither their names nor what lies beside them matters; what has no mesh's ending is looked at all the same."""
    return {
        f"{number:08}{path.suffix if path.suffix.lower() in MESH_SUFFIXES else MESH_SUFFIXES[0]}": name
        for number, (name, path) in enumerate(meshes.items())
    }
