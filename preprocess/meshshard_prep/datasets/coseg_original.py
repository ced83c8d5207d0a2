"""COSEG as published: `<set>/shapes/*.off` and `<set>/gt/*.seg`, one 1-based label a face, no official split."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from meshshard.errors import UsageError
from meshshard_prep.datasets.coseg import CITATION, LICENCE, PARTS, part_names
from meshshard_prep.datasets.draws import folder_of, shares
from meshshard_prep.datasets.joined import joined
from meshshard_prep.datasets.layout import Adapter, Entry, LabelFile, RawDataset
from meshshard_prep.datasets.meshcnn import mesh_files
from meshshard_prep.datasets.told import lacking

FOLDERS = {
    "aliens": ("tele-aliens", "aliens"),
    "chairs": ("chairs", "large-chairs"),
    "vases": ("vases", "large-vases"),
}
"""Set -> names its folder goes by, in small letters and with '-' for '_'."""


def read_set(root: Path, shape: str) -> RawDataset:
    """One set: `root` is its folder, or the folder that holds it."""
    found = _read(root if (root / "shapes").is_dir() else _folder(root, shape), shape)
    if not found.entries:
        raise UsageError(
            f"{root} is not in the layout of COSEG: no meshes in {root}/{FOLDERS[shape][0]}/shapes; where labels are "
            f"in seg/*.eseg the data set is called coseg_{shape}"
        )
    return found


def read_all(root: Path) -> RawDataset:
    """The sets as one data set. Classes are those of all three, also where one of them is not there."""
    folders = {shape: _folder(root, shape) for shape in PARTS}
    there = [shape for shape, folder in folders.items() if folder]
    if not there:
        raise UsageError(f"{root} is not in the layout of COSEG: it has no folder called as {', '.join(FOLDERS)}")
    parts = [(shape, folder.name if folder else "", _read(folder, shape)) for shape, folder in folders.items()]
    return replace(joined("coseg_original", parts), notes=lacking("sets", PARTS, there))


def _read(folder: Path | None, shape: str) -> RawDataset:
    """The set in a folder; none of its meshes, where there is no folder."""
    table: dict[int | str, int] = {1 + part: part for part in range(PARTS[shape])}
    entries = [
        Entry(
            id=path.stem,
            path=path,
            source=f"shapes/{path.name}",
            labels=LabelFile(path=folder / "gt" / f"{path.stem}.seg", classes=table, domains=("face",)),
        )
        for path in (mesh_files(folder / "shapes") if folder else [])
        if folder
    ]
    return RawDataset(
        name=f"coseg_original_{shape}", task="segmentation", classes=part_names(shape), entries=tuple(entries)
    )


def _folder(root: Path, shape: str) -> Path | None:
    """The folder of a set below `root`, by any of its names."""
    inside = sorted(root.iterdir())
    return next((path for path in inside if path.name.lower().replace("_", "-") in FOLDERS[shape]), None)


def _adapter(name: str, summary: str, meshes: int, read: Callable[[Path], RawDataset]) -> Adapter:
    return Adapter(
        name=name,
        page="coseg",
        summary=summary,
        licence=LICENCE,
        citation=CITATION,
        origin="the COSEG pages of Shandong University: shapes.zip and gt.zip of each set, unpacked side by side",
        expected={"": meshes},
        read=read,
        split=shares(0.85, folder_of),
        folder="coseg_original",
    )


ADAPTERS = (
    _adapter("coseg_original", "COSEG as published, three sets as one, 11 parts", 900, read_all),
    _adapter(
        "coseg_original_aliens", "COSEG aliens as published, 4 parts", 200, lambda root: read_set(root, "aliens")
    ),
    _adapter(
        "coseg_original_chairs", "COSEG chairs as published, 3 parts", 400, lambda root: read_set(root, "chairs")
    ),
    _adapter("coseg_original_vases", "COSEG vases as published, 4 parts", 300, lambda root: read_set(root, "vases")),
)
