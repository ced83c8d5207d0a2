"""COSEG in the archive the paper used (PD-MeshNet's): MeshCNN's folders, but one 0-based label for each face."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from meshshard.errors import InvalidMesh, UsageError
from meshshard_prep.counts import counts_of
from meshshard_prep.datasets.joined import joined
from meshshard_prep.datasets.layout import Adapter, Entry, RawDataset
from meshshard_prep.datasets.meshcnn import read_segmentation
from meshshard_prep.formats import read_file

PARTS = {"aliens": 4, "chairs": 3, "vases": 4}
"""Set -> how many parts its shapes have. The archive does not name them."""

LICENCE = "research only; no licence stated"
CITATION = "Wang et al. 2012, Active Co-Analysis of a Set of Shapes"


def part_names(shape: str) -> tuple[str, ...]:
    """Names for the parts of a set, which are published as numbers."""
    return tuple(f"{shape} part {number}" for number in range(PARTS[shape]))


def read_set(root: Path, shape: str) -> RawDataset:
    """One set: `root` is its folder, or the folder that holds coseg_<shape>."""
    inside = root / f"coseg_{shape}"
    folder = inside if inside.is_dir() else root
    parts = part_names(shape)
    found = read_segmentation(folder, name=f"coseg_{shape}", classes=parts, first_value=0)
    return replace(found, entries=tuple(_counted(entry, len(parts)) for entry in found.entries))


def _counted(entry: Entry, parts: int) -> Entry:
    """The archive the paper used labels faces and counts from 0; MeshCNN's own labels edges and counts from 1."""
    if entry.labels is None or not entry.labels.path.is_file():
        return entry
    try:
        mesh, labels = read_file(entry.path, entry.source), read_file(entry.labels.path, entry.labels.path.name)
    except InvalidMesh:
        return entry  # the run refuses it
    of_faces = counts_of(entry.path, mesh).faces == len(labels.split())
    first, domain = (0, "face") if of_faces else (1, "edge")
    table: dict[int | str, int] = {first + part: part for part in range(parts)}
    return replace(entry, labels=replace(entry.labels, classes=table, domains=(domain,)))


def read_all(root: Path) -> RawDataset:
    """The three sets as one data set: eleven classes, ids that begin with the set's name."""
    missing = [f"coseg_{shape}" for shape in PARTS if not (root / f"coseg_{shape}").is_dir()]
    if missing:
        raise UsageError(f"{root} lacks {', '.join(missing)}; add what is missing, or name one set, as coseg_chairs")
    return joined("coseg", [(shape, f"coseg_{shape}", read_set(root, shape)) for shape in PARTS])


def _adapter(name: str, summary: str, read: Callable[[Path], RawDataset], **expected: int) -> Adapter:
    return Adapter(
        name=name,
        page="coseg",
        summary=summary,
        licence=LICENCE,
        citation=f"{CITATION}; archive: Milano et al. 2020 (PD-MeshNet)",
        origin="PD-MeshNet's COSEG archive: the folders coseg_aliens, coseg_chairs and coseg_vases",
        read=read,
        expected=expected,
    )


ADAPTERS = (
    _adapter("coseg", "COSEG aliens, chairs and vases as one data set, 11 parts", read_all),
    _adapter("coseg_aliens", "COSEG aliens, 4 parts", lambda root: read_set(root, "aliens"), train=169),
    _adapter("coseg_chairs", "COSEG chairs, 3 parts", lambda root: read_set(root, "chairs")),
    _adapter("coseg_vases", "COSEG vases, 4 parts", lambda root: read_set(root, "vases")),
)
