"""A folder of exported meshes: export.json says whose it is and what it holds."""

import json
from collections.abc import Sequence
from pathlib import Path, PurePosixPath
from typing import Any

from meshshard.dataset import Dataset
from meshshard.errors import InvalidMesh, InvalidShard, UsageError
from meshshard.export import Exporter
from meshshard.files import LOCK_NAME, lock_folder, publish
from meshshard.plain import to_json

LIST_NAME = "export.json"
LIST_FORMAT = "meshshard-export"


def write_export(
    dataset: Dataset, numbers: Sequence[int], form: str, exporter: Exporter, out: Path
) -> dict[str, Any]:
    """Write a file for each of these samples, named after its id, and then export.json. Returns what that holds:
    the `files`, their `bytes` together, why meshes were `refused`, and the exporter's `note`, if any.

    A folder that holds an export of the same data set in the same format is brought up to date: files that it listed
    and that are not written again go. UsageError where `out` holds anything else.
    """
    names = {number: _file_name(dataset.ids[number], exporter.suffix, dataset) for number in numbers}
    owner = {"format": LIST_FORMAT, "dataset": dataset.name, "to": form}
    before = _listed(out, owner)
    with lock_folder(out):
        # first as a claim to the folder, so that an export that was stopped may be called again
        publish(out / LIST_NAME, to_json(owner | {"files": sorted({*before, *names.values()})}).encode() + b"\n")
        written: dict[str, int] = {}
        refused = []
        for number, name in names.items():
            try:
                content = exporter.encode(dataset[number])
            except InvalidMesh as error:
                refused.append(str(error))
                continue
            (out / name).parent.mkdir(parents=True, exist_ok=True)
            publish(out / name, content)
            written[name] = len(content)
        for name in set(before) - set(written):
            (out / name).unlink(missing_ok=True)
        report = owner | {"files": sorted(written), "bytes": sum(written.values()), "refused": refused}
        report |= {"note": exporter.note} if exporter.note else {}
        publish(out / LIST_NAME, to_json(report).encode() + b"\n")
    return report


def _file_name(name: str, suffix: str, dataset: Dataset) -> str:
    """The file of a mesh, relative to the folder of the export, which an id must not leave."""
    if not _inside(name):
        raise InvalidShard(f"{dataset.folder}: the id {name!r} is no name of a file inside a folder")
    return f"{name}{suffix}"


def _inside(name: str) -> bool:
    path = PurePosixPath(name)
    return bool(path.parts) and not path.is_absolute() and ".." not in path.parts and "\0" not in name


def _listed(out: Path, owner: dict[str, str]) -> list[str]:
    """Files that an earlier export of the same kind listed; none where the folder is new or empty."""
    if not out.exists() or (out.is_dir() and {path.name for path in out.iterdir()} <= {LOCK_NAME}):
        return []
    try:
        table = json.loads((out / LIST_NAME).read_bytes())
        files = [str(name) for name in table["files"] if _inside(str(name))]
        found = {key: table[key] for key in owner}
    except (OSError, ValueError, KeyError, TypeError):
        raise UsageError(f"{out} is no folder of exported meshes and not empty; name another with --out") from None
    if found != owner:
        raise UsageError(
            f"{out} holds an export of {found['dataset']} to {found['to']}, "
            f"not of {owner['dataset']} to {owner['to']}; name another folder with --out"
        )
    return files
