"""A known data set's archives, loaded or given, to the folder of its raw files in one step."""

import shutil
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from meshshard.errors import UsageError
from meshshard.files import LOCK_NAME, lock_folder, sha256_of_file
from meshshard_prep.datasets import RawDataset, read_dataset
from meshshard_prep.fetch.download import PART, STATE, NotLoaded, Tell, load
from meshshard_prep.fetch.record import FetchedArchive, changes, read_record, write_record
from meshshard_prep.fetch.source import Archive, Source
from meshshard_prep.fetch.unpack import unpack

REPLACED = "replaced"
"""Below the working folder: the raw files that are being replaced."""


@dataclass(frozen=True, kw_only=True)
class Fetched:
    """What `fetch` did. `dataset`: what the adapter read. `notes`: what is missing or odd, as sentences."""

    dataset: RawDataset
    archives: tuple[FetchedArchive, ...]
    notes: tuple[str, ...]


def is_there(folder: Path) -> bool:
    """Whether a folder holds something already."""
    return folder.exists() and (not folder.is_dir() or any(folder.iterdir()))


def working_folder(folder: Path) -> Path:
    """Where what is not finished lies, beside the folder of the raw files."""
    return folder.with_name(f".fetch-{folder.name}")


def fetch(
    name: str, source: Source, folder: Path, tell: Tell, *, given: Sequence[Path] = (), replace: bool = False
) -> Fetched | None:
    """Load the archives of data set `name`, or take those `given`, check them, unpack them, and make them `folder`.

    Gives None where something is there already; with `replace` that is replaced, if an earlier call put it there.
    Killed at any time it leaves `folder` as it was, or whole. UsageError: an archive cannot be had, is refused, or
    is not of this data set.
    """
    files = assign(name, source, given)
    work = working_folder(folder)
    with lock_folder(work):
        _tidy(work, folder, keep={archive.file for archive in source.archives})
        before = _replaceable(folder, replace) if is_there(folder) else ()
        if before is None:
            shutil.rmtree(work)
            return None
        loaded = [
            (archive, files[archive.file] or [_load(name, source, archive, given, work, tell)])
            for archive in source.archives
        ]
        with _nothing_left(work):
            archives, notes = _unpack_all(loaded, files, work)
            whole = work / "whole"
            dataset = _read(name, whole)
            write_record(whole, archives)
        _put(whole, folder, work)
        shutil.rmtree(work)
    return Fetched(dataset=dataset, archives=archives, notes=(*changes(before, archives), *notes, *dataset.notes))


def assign(name: str, source: Source, given: Sequence[Path]) -> dict[str, list[Path]]:
    """Archive's file name -> what was given for it. UsageError: no such file, none of the data set's archives, or one
    that cannot be loaded is not given."""
    names = [archive.file for archive in source.archives]
    if not names:
        raise UsageError(f"{name} has to be unpacked by hand: open {source.page}, {source.by_hand}")
    for path in given:
        if not path.is_file():
            raise UsageError(f"--archive {path} is no file")
        if len(names) > 1 and path.name not in names:
            raise UsageError(f"{path} is none of the archives of {name}, which are known by name: {', '.join(names)}")
    files = {file: [path for path in given if len(names) == 1 or path.name == file] for file in names}
    if missing := [archive.file for archive in source.archives if not archive.url and not files[archive.file]]:
        raise UsageError(
            f"{' and '.join(missing)} cannot be loaded by a program: open {source.page}, {source.by_hand}, and type: "
            f"{_command(name, given, missing)}"
        )
    return files


def _command(name: str, given: Sequence[Path], more: Sequence[str]) -> str:
    """What to type, with the archives that were given and those that are to be."""
    return " ".join(["meshshard fetch", name, *(f"--archive {file}" for file in (*given, *more))])


def _load(name: str, source: Source, archive: Archive, given: Sequence[Path], work: Path, tell: Tell) -> Path:
    try:
        return load(archive, work, tell)
    except NotLoaded as error:
        if not any((work / f"{each.file}{end}").exists() for each in source.archives for end in ("", PART)):
            shutil.rmtree(work)
        raise UsageError(
            f"{error}. Try again later; or open {source.page}, download the archive with a browser, save it as "
            f"{archive.file}, and type: {_command(name, given, [archive.file])}"
        ) from error


def _replaceable(folder: Path, replace: bool) -> tuple[FetchedArchive, ...] | None:
    """What an earlier call put there; None for leaving it."""
    if not replace:
        return None
    record = read_record(folder)
    if record is None:
        raise UsageError(
            f"{folder} was not put there by `meshshard fetch`, and --force would delete it; move it away"
        )
    return record


def _unpack_all(
    loaded: list[tuple[Archive, list[Path]]], given: dict[str, list[Path]], work: Path
) -> tuple[tuple[FetchedArchive, ...], list[str]]:
    """Make work/whole from the archives; what they are, and notes."""
    archives, notes = [], []
    for number, (archive, paths) in enumerate(loaded):
        tree = work / f"unpacked{number}"
        for path in paths:
            archives.append(_identified(archive, path, loaded=not given[archive.file], alone=len(paths) == 1))
            unpack(path, work / "part")
            _merge(work / "part", tree, path.name)
        target = work / "whole" / archive.into
        _merge(_wanted(tree, archive.file, archive.holds), target, archive.file)
        if archive.beside and not any(target.glob(archive.beside)):
            found = _wanted(tree, archive.file, archive.beside)
            for path in list(found.glob(archive.beside)):
                path.rename(target / path.name)
        if archive.size not in (0, archives[-1].bytes) and len(paths) == 1:
            notes.append(f"{archive.file} has {archives[-1].bytes:,} bytes, where {archive.size:,} were published")
        if left := sum(path.is_file() for path in tree.rglob("*")):
            notes.append(f"files of {archive.file} left out, for they lie beside the folder that is wanted: {left}")
    return tuple(archives), notes


def _identified(archive: Archive, path: Path, *, loaded: bool, alone: bool) -> FetchedArchive:
    digest = sha256_of_file(path)
    if archive.sha256 not in ("", digest):
        raise UsageError(f"the sha256 of {path} is {digest}, where {archive.sha256} was published")
    return FetchedArchive(
        file=archive.file if alone else path.name,
        url=archive.url if loaded else "",
        sha256=digest,
        bytes=path.stat().st_size,
        date=time.strftime("%Y-%m-%d"),
    )


def _read(name: str, folder: Path) -> RawDataset:
    try:
        return read_dataset(name, folder, make=False)
    except UsageError as error:
        raise UsageError(f"what was unpacked is not {name}: {error}") from error


def _wanted(tree: Path, file: str, pattern: str) -> Path:
    """The shallowest folder that holds what an archive is wanted for."""
    tree.mkdir(exist_ok=True)  # the whole of it may have been taken
    folders = [tree, *(path for path in sorted(tree.rglob("*"), key=lambda p: (len(p.parts), p)) if path.is_dir())]
    for folder in folders:
        if any(folder.glob(pattern)):
            return folder
    found = ", ".join(sorted(path.name for path in tree.iterdir())[:5]) or "nothing"
    raise UsageError(f"{file} is not what was published: no folder in it holds {pattern}; found: {found}")


def _merge(source: Path, target: Path, name: str) -> None:
    """Move all that is in `source` into `target`. UsageError: a file is there already."""
    target.mkdir(parents=True, exist_ok=True)
    for path in sorted(source.iterdir()):
        there = target / path.name
        if path.is_dir() and there.is_dir():
            _merge(path, there, name)
        elif there.exists():
            raise UsageError(f"{name} holds {path.name}, which another archive of the data set holds too")
        else:
            path.rename(there)
    source.rmdir()


@contextmanager
def _nothing_left(work: Path) -> Iterator[None]:
    """What is refused is not kept, so that the next call loads it anew."""
    try:
        yield
    except UsageError:
        shutil.rmtree(work)
        raise


def _tidy(work: Path, folder: Path, keep: set[str]) -> None:
    """Put back what a killed call was replacing, and remove what it left, but for archives and parts of them."""
    if (work / REPLACED).exists() and not folder.exists():
        (work / REPLACED).rename(folder)
    kept = {LOCK_NAME, *keep, *(f"{file}{ending}" for file in keep for ending in (PART, STATE))}
    for path in work.iterdir():
        if path.name not in kept:
            shutil.rmtree(path) if path.is_dir() else path.unlink()


def _put(whole: Path, folder: Path, work: Path) -> None:
    if folder.exists():
        folder.rename(work / REPLACED)
    whole.rename(folder)
