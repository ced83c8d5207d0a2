"""IntrA: blood vessels with an aneurysm, one label a vertex, five official folds."""

from pathlib import Path

from meshshard.errors import UsageError
from meshshard_prep.datasets.draws import by_fold
from meshshard_prep.datasets.layout import Adapter, Entry, LabelFile, RawDataset
from meshshard_prep.datasets.meshcnn import mesh_files
from meshshard_prep.datasets.told import lacking

CLASSES = ("vessel", "aneurysm")
TABLE: dict[int | str, int] = {0: 0, 1: 1, 2: 1}
"""2 is the boundary between the two; it counts as aneurysm, as in the benchmark."""

FOLDS = 5
MESH, LABELS = "_full", "-_norm"
"""What follows the name of a segment: `AN3_full.obj`, `AN3-_norm.ad`."""


def read(root: Path) -> RawDataset:
    """`annotated/obj/*_full.obj`, `annotated/ad/*-_norm.ad` (position, normal, label of each vertex), and the folds
    `fileSplit/seg/annSplit_{0..4}.txt`, which list .ad files.

    A segment's group is its vessel, AN168 of AN168-2. UsageError: no meshes, or a fold's list is not there.
    """
    folds = _folds(root)
    names = {path.stem.removesuffix(MESH): path for path in mesh_files(root / "annotated/obj")}
    if not names:
        raise UsageError(f"{root} is not in the layout of IntrA: no meshes in {root}/annotated/obj")
    entries = [
        Entry(
            id=name,
            path=path,
            source=f"annotated/obj/{path.name}",
            group=name.split("-")[0],
            labels=LabelFile(
                path=root / "annotated/ad" / f"{name}{LABELS}.ad",
                form="last-column",
                classes=TABLE,
                domains=("vertex",),
            ),
        )
        for name, path in names.items()
        if name in folds
    ]
    return RawDataset(
        name="intra",
        task="segmentation",
        classes=CLASSES,
        entries=tuple(entries),
        folds={entry.id: folds[entry.id] for entry in entries},
        notes=(
            *lacking("meshes", folds, names),
            *(f"{name}{MESH} is in no fold, and was not read" for name in names if name not in folds),
        ),
    )


def _folds(root: Path) -> dict[str, int]:
    """Segment -> the fold that lists it."""
    found: dict[str, int] = {}
    for fold in range(FOLDS):
        path = root / "fileSplit" / "seg" / f"annSplit_{fold}.txt"
        if not path.is_file():
            raise UsageError(
                f"{path} is not there; the folds of IntrA are in its repository, in the folder fileSplit"
            )
        for line in path.read_text(encoding="utf-8", errors="replace").split():
            found[line.rsplit("/", 1)[-1].removesuffix(".ad").removesuffix(LABELS)] = fold
    return found


ADAPTER = Adapter(
    name="intra",
    page="intra",
    summary="IntrA: vessels and aneurysms, 116 meshes, five official folds (--fold K is test)",
    licence="open access for research; no licence stated",
    citation="Yang et al. 2020, IntrA: 3D Intracranial Aneurysm Dataset for Deep Learning",
    origin="the IntrA folder that its repository links to, with the repository's folder fileSplit in it",
    expected={"": 116},
    read=read,
    split=by_fold,
)
