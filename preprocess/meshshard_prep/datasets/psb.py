"""The Princeton segmentation benchmark with Kalogerakis' labels: `<Class>/<id>.off`, `<Class>/<id>_labels.txt`."""

from dataclasses import replace
from functools import partial
from pathlib import Path

from meshshard.errors import UsageError
from meshshard_prep.datasets.draws import folder_of, per_class
from meshshard_prep.datasets.joined import joined
from meshshard_prep.datasets.layout import Adapter, Entry, LabelFile, RawDataset
from meshshard_prep.datasets.meshcnn import mesh_files
from meshshard_prep.datasets.told import lacking
from meshshard_prep.labels import class_table

FIRST = {
    "Human": 1,
    "Cup": 21,
    "Glasses": 41,
    "Airplane": 61,
    "Ant": 81,
    "Chair": 101,
    "Octopus": 121,
    "Table": 141,
    "Teddy": 161,
    "Hand": 181,
    "Plier": 201,
    "Fish": 221,
    "Bird": 241,
    "Armadillo": 281,
    "Bust": 301,
    "Mech": 321,
    "Bearing": 341,
    "Vase": 361,
    "FourLeg": 381,
}
"""Class -> number of its first mesh of twenty. 261 to 280 are springs, which have no labels."""

TRAIN = 12
"""Of the twenty, as in most papers."""


def read_class(root: Path, kind: str) -> RawDataset:
    """One class: `root` holds its folder. Its parts are those that its label files name, in alphabetical order."""
    folder = root / kind
    meshes = mesh_files(folder)
    if not meshes:
        raise UsageError(f"{root} is not in the layout of the Princeton benchmark: no meshes in {folder}")
    files = [LabelFile(path=path.with_name(f"{path.stem}_labels.txt"), form="psb") for path in meshes]
    parts, table = class_table([file for file in files if file.path.is_file()], (), folder)
    entries = [
        Entry(id=path.stem, path=path, source=path.name, labels=replace(file, classes=table, domains=("face",)))
        for path, file in zip(meshes, files, strict=True)
    ]
    numbers = [str(FIRST[kind] + number) for number in range(20)]
    return RawDataset(
        name=f"psb_{kind.lower()}",
        task="segmentation",
        classes=parts,
        entries=tuple(entries),
        notes=lacking(f"meshes of {kind}", numbers, [path.stem for path in meshes]),
    )


def read_all(root: Path) -> RawDataset:
    """All classes that are there. A part is called after its class too: the heads of birds and of bodies differ."""
    there = [kind for kind in sorted(FIRST) if mesh_files(root / kind)]
    if not there:
        raise UsageError(f"{root} is not in the layout of the Princeton benchmark: no meshes in {root}/Airplane")
    parts = []
    for kind in there:
        found = read_class(root, kind)
        named = replace(found, classes=tuple(f"{kind} {part}" for part in found.classes))
        parts.append((kind, kind, named))
    whole = joined("psb", parts)
    return replace(whole, notes=lacking("classes", sorted(FIRST), there) + whole.notes)


ALL = Adapter(
    name="psb",
    page="psb",
    summary="Princeton segmentation benchmark, its 19 classes as one data set",
    licence="research only; no licence stated",
    citation="Chen et al. 2009, A Benchmark for 3D Mesh Segmentation; labels: Kalogerakis et al. 2010, Learning 3D "
    "Mesh Segmentation and Labeling",
    origin="labeledDb, the archive of Kalogerakis et al., whose folder is LabeledDB_new",
    expected={"": 380},
    read=read_all,
    split=per_class(TRAIN, folder_of),
)

ADAPTERS = (
    ALL,
    *(
        replace(
            ALL,
            name=f"psb_{kind.lower()}",
            summary="one class of the Princeton segmentation benchmark, 12 + 8 meshes drawn by --split-seed",
            expected={"": 20},
            read=partial(read_class, kind=kind),
            folder="psb",
        )
        for kind in sorted(FIRST)
    ),
)
