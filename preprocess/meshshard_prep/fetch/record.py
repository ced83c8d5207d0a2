"""What was fetched, from where, with which content: FETCHED.json among the raw files."""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from meshshard.errors import UsageError
from meshshard.files import publish

RECORD_NAME = "FETCHED.json"


@dataclass(frozen=True, kw_only=True)
class FetchedArchive:
    """An archive as it was unpacked: `url` is empty for one that was downloaded by hand, `date` is year-month-day."""

    file: str
    url: str
    sha256: str
    bytes: int
    date: str


def write_record(folder: Path, archives: Sequence[FetchedArchive]) -> None:
    """Write the record of a folder of raw files."""
    text = json.dumps({"archives": [asdict(archive) for archive in archives]}, indent=1)
    publish(folder / RECORD_NAME, f"{text}\n".encode(), durable=False)


def read_record(folder: Path) -> tuple[FetchedArchive, ...] | None:
    """The record of a folder, or None where there is none. UsageError: it was changed and cannot be read."""
    path = folder / RECORD_NAME
    if not path.is_file():
        return None
    try:
        return tuple(FetchedArchive(**archive) for archive in json.loads(path.read_bytes())["archives"])
    except (ValueError, TypeError, KeyError) as error:
        raise UsageError(f"{path} is not what `meshshard fetch` writes ({error}); delete it") from error


def changes(before: Sequence[FetchedArchive], now: Sequence[FetchedArchive]) -> list[str]:
    """A sentence for each archive that has another content than when it was fetched before."""
    known = {archive.file: archive for archive in before}
    return [
        f"{archive.file} has changed since {known[archive.file].date}: its sha256 was "
        f"{known[archive.file].sha256[:12]}, and is {archive.sha256[:12]} now"
        for archive in now
        if archive.file in known and known[archive.file].sha256 != archive.sha256
    ]
