"""Data sets by name, by TOML file, by folder or by mesh file. One adapter is one small file."""

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from meshshard.errors import UsageError
from meshshard.remote import RemotePath, listed, to_path
from meshshard_prep.datasets import (
    coseg,
    coseg_original,
    cubes,
    faust_scape,
    human_seg,
    human_seg_original,
    intra,
    minicoseg,
    modelnet,
    psb,
    shrec11,
)
from meshshard_prep.datasets.folder import read_folder
from meshshard_prep.datasets.layout import Adapter, Draw, Entry, LabelFile, RawDataset
from meshshard_prep.datasets.own import read_toml
from meshshard_prep.fetch.sources import source_of

__all__ = ["ADAPTERS", "Adapter", "Draw", "Entry", "LabelFile", "RawDataset", "read_dataset"]

ADAPTERS = {
    adapter.name: adapter
    for adapter in (
        minicoseg.ADAPTER,
        human_seg.ADAPTER,
        human_seg_original.ADAPTER,
        *coseg.ADAPTERS,
        *coseg_original.ADAPTERS,
        intra.ADAPTER,
        *psb.ADAPTERS,
        *shrec11.ADAPTERS,
        *modelnet.ADAPTERS,
        cubes.ADAPTER,
        *faust_scape.ADAPTERS,
    )
}
"""Every data set known by name."""


def read_dataset(
    name: str,
    raw: Path | None = None,
    tell: Callable[[str], None] | None = None,
    *,
    make: bool = True,
    draw: Draw = Draw(),  # noqa: B008  frozen
) -> RawDataset:
    """What `meshshard features NAME --raw DIR` means: a known name, a .toml file, a folder, or one mesh file.

    Folders and files may lie behind URLs, s3://bucket/folder say. A known data set is looked for in `raw`, by default
    data/raw/NAME, and made there if it can be generated, unless `make` is false; `tell` is told so. `draw` says which
    of its splits is meant, where there are several. UsageError says where the files come from and what to type, or
    that there is no such fold.
    """
    if name in ADAPTERS:
        adapter, root = ADAPTERS[name], listed(raw or Path("data/raw") / (ADAPTERS[name].folder or name))
        if make and adapter.generate and not adapter.is_complete(root):
            if isinstance(root, RemotePath):
                raise UsageError(f"{name} is made on this machine only, and {root} does not hold it; leave out --raw")
            if tell:
                tell(f"making the raw files of {name} in {root}")
            adapter.generate(root)
        if not adapter.is_complete(root):
            if adapter.generate:
                raise UsageError(f"the raw files of {name} are not in {root}: they are {adapter.origin}")
            then = f"Type: meshshard fetch {name}" if source_of(adapter) else "Unpack them there"
            raise UsageError(
                f"the raw files of {name} are not in {root}. They come from {adapter.origin} ({adapter.licence}). "
                f"{then}, or say where they are: make features DATASET={name} RAW=<folder>"
            )
        return _known(adapter, adapter.read(root), draw)
    if not name:
        raise UsageError("a data set is a known name, a folder, a mesh file or a .toml file; an empty name is none")
    path = listed(to_path(name))
    if path.suffix == ".toml" and path.is_file():
        return read_toml(path, raw, draw)
    if raw is not None:
        raise UsageError(f"--raw goes with a data set's name or a .toml file; {name!r} is neither")
    if path.exists():
        _check_fold(name, draw, folds=False)
        return read_folder(path)
    raise UsageError(
        f"{name!r} is no known data set, and no folder, mesh or .toml file of that name was found; "
        f"known are {', '.join(ADAPTERS)}"
    )


def _known(adapter: Adapter, found: RawDataset, draw: Draw) -> RawDataset:
    """What was read, with what is known about the data set: its licence, its splits, what is missing."""
    notes = (*found.notes, *_counted(adapter, found))
    _check_fold(adapter.name, draw, folds=bool(found.folds))
    found = replace(found, name=adapter.name, licence=adapter.licence, citation=adapter.citation, notes=notes)
    return adapter.split(found, draw) if adapter.split else found


def _check_fold(name: str, draw: Draw, *, folds: bool) -> None:
    if draw.fold and not folds:
        raise UsageError(
            f"{name} has no folds, so there is no fold {draw.fold}; leave out --fold, or say splits.folds in a .toml "
            "file, which meshshard scan writes"
        )


def _counted(adapter: Adapter, found: RawDataset) -> list[str]:
    """A sentence for each number of meshes or classes that is not the published one."""
    counts = Counter(entry.split for entry in found.entries) | Counter({"classes": len(found.classes)})
    words = {what: what if what == "classes" else f"{what} meshes".strip() for what in adapter.expected}
    return [
        f"{adapter.name} has {expected} {words[what]}, and {counts[what]} were found"
        for what, expected in adapter.expected.items()
        if counts[what] != expected
    ]
