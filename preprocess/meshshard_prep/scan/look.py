"""All that a folder holds, as far as it matters for a data set."""

from collections import Counter
from collections.abc import Callable, Collection, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from meshshard.errors import InvalidMesh, UsageError
from meshshard.remote import listed
from meshshard_prep.counts import Counts, counts_of
from meshshard_prep.datasets.folder import mesh_entries
from meshshard_prep.datasets.layout import Entry
from meshshard_prep.datasets.own.labels import filled_in
from meshshard_prep.datasets.own.names import Names
from meshshard_prep.formats import read_file
from meshshard_prep.labels.ply import left_out
from meshshard_prep.scan.folders import ClassFolders, class_folders, sets_of
from meshshard_prep.scan.known import known_as
from meshshard_prep.scan.labels import Labelling, labels_in_files, labels_in_meshes
from meshshard_prep.scan.lists import Lists, find_lists
from meshshard_prep.scan.names import patterns_of
from meshshard_prep.scan.one_json import labels_in_one_json

OTHER_MESHES = (
    ".stl",
    ".glb",
    ".gltf",
    ".fbx",
    ".dae",
    ".3ds",
    ".wrl",
    ".vtk",
    ".vtp",
    ".mesh",
    ".msh",
    ".x3d",
    ".usd",
)
"""Suffixes of meshes that are not read here."""

READERS = 8
"""Files read at once: behind a URL, waiting is most of the work."""

Told = Callable[[str, int, int], None]


@dataclass(frozen=True, kw_only=True)
class Findings:
    """`known`, `like`: what `known_as` says. `counts`: source ->
    what its file has. `labellings`: the best first. `sets`: top folders with labels of their own. `lonely`: files
    that look like labels, of meshes that are not there. `others`: suffix -> files that are none of all this.
    `left_out`: where nothing is labelled, properties of the first PLY file that are no labels."""

    root: Path
    known: str
    like: str
    entries: tuple[Entry, ...]
    counts: dict[str, Counts]
    labellings: tuple[Labelling, ...]
    sets: tuple[str, ...]
    lonely: tuple[str, ...]
    folders: ClassFolders | None
    lists: Lists
    others: dict[str, int]
    left_out: tuple[str, ...]

    @property
    def splits(self) -> dict[str, int]:
        """Split -> meshes, by folders; "" for those in none."""
        return dict(Counter(entry.split for entry in self.entries))

    @property
    def refused(self) -> list[str]:
        """Why files that are named like meshes are none."""
        return [count.refusal for count in self.counts.values() if count.refusal]


def look(root: Path, told: Told) -> Findings:
    """Look at a folder. `told(what, done, of)` hears how far it is. UsageError: it is no folder, or holds no mesh."""
    root = listed(root)
    if not root.is_dir():
        raise UsageError(f"{root} is no folder; scan looks at a folder of meshes")
    files = [path.relative_to(root).as_posix() for path in _files(root)]
    try:
        entries = mesh_entries(root)
    except UsageError as error:
        foreign = sum(PurePosixPath(file).suffix.lower() in OTHER_MESHES for file in files)
        hint = f"; {foreign} files are meshes of other formats: convert them to one of these" if foreign else ""
        raise UsageError(f"{error}{hint}") from None
    counts = _counts(entries, told)
    readable = {source: count for source, count in counts.items() if not count.refusal}
    others = sorted(set(files) - {entry.source for entry in entries})
    in_files = {
        pattern: labelling
        for pattern in patterns_of(list(readable), others)
        if (labelling := labels_in_files(root, pattern, readable, lambda done, of: told("labels", done, of)))
    }
    in_one = [] if in_files else labels_in_one_json(root, others, readable, lambda a, b: told("labels", a, b))
    found = [*in_files.values(), *in_one]
    if not found:
        found = labels_in_meshes(entries, readable, lambda done, of: told("labels in meshes", done, of))
    claimed = {file for pattern in in_files for file in pattern.files.values()}
    left = [other for other in others if other not in claimed and other not in {one.pattern for one in in_one}]
    lonely = _lonely(left, claimed)
    known, like = known_as(root, entries)
    found.sort(key=lambda labelling: -len(labelling.of))
    return Findings(
        root=root,
        known=known,
        like=like,
        entries=entries,
        counts=counts,
        labellings=tuple(found),
        sets=_sets(found[0]) if in_files else (),
        lonely=lonely,
        folders=class_folders(entries),
        lists=find_lists(root, left, Names(entries)),
        others=dict(Counter(PurePosixPath(other).suffix.lower() for other in sorted({*left} - {*lonely}))),
        left_out=() if found else _left_out(entries, readable),
    )


def _left_out(entries: Sequence[Entry], readable: Collection[str]) -> tuple[str, ...]:
    first = next(
        (entry for entry in entries if entry.source in readable and entry.path.suffix.lower() == ".ply"), None
    )
    return tuple(left_out(first.path.read_bytes(), first.source)) if first else ()


def _sets(labelling: Labelling) -> tuple[str, ...]:
    return sets_of({source: filled_in(labelling.pattern, source) for source in labelling.of})


def _files(folder: Path) -> Iterator[Path]:
    """Every regular file below a folder, passing over what `mesh_entries` passes over."""
    for path in folder.iterdir():
        if path.name.startswith("."):
            continue
        if path.is_file():
            yield path
        elif path.is_dir() and not path.is_symlink():
            yield from _files(path)


def _counts(entries: Sequence[Entry], told: Told) -> dict[str, Counts]:
    def count(entry: Entry) -> Counts:
        try:
            return counts_of(entry.path, read_file(entry.path, entry.source))
        except InvalidMesh as error:
            return Counts(path=entry.path, refusal=str(error))

    found = {}
    with ThreadPoolExecutor(READERS) as pool:
        for done, (entry, counts) in enumerate(zip(entries, pool.map(count, entries), strict=True), start=1):
            found[entry.source] = counts
            told("meshes", done, len(entries))
    return found


def _lonely(left: Sequence[str], claimed: Collection[str]) -> tuple[str, ...]:
    """Files with the suffix of label files, in their folders."""
    kinds = {(PurePosixPath(file).parent, PurePosixPath(file).suffix) for file in claimed}
    return tuple(file for file in left if (PurePosixPath(file).parent, PurePosixPath(file).suffix) in kinds)
