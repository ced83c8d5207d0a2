"""Human bodies as published by Maron et al. 2017: one 1-based label a face, in files that many meshes share."""

from pathlib import Path

from meshshard.errors import UsageError
from meshshard_prep.datasets.human_seg import CITATION, LICENCE, PARTS, group_of
from meshshard_prep.datasets.layout import Adapter, Entry, LabelFile, RawDataset
from meshshard_prep.datasets.meshcnn import mesh_files
from meshshard_prep.datasets.told import lacking, not_read

POSES = ("bouncing", "crane", "handstand", "jumping", "march1", "march2", "squat1", "squat2")

SHARED_LABELS = {
    "train/faust": "train/faust/faust_corrected.txt",
    "train/scape": "train/scape/scape_corrected.txt",
    **{f"train/MIT_animation/meshes_{pose}/meshes": f"train/mit/mit_{pose}_corrected.txt" for pose in POSES},
}
"""Folder below meshes/ -> the label file below segs/ of all its meshes."""

TESTS = {number: str(number) for number in range(1, 21) if number not in (16, 18)} | {12: "12_fix_orientation"}
"""Test body -> the name of its mesh."""


def read(root: Path) -> RawDataset:
    """`meshes/{train,test}/...` and `segs/{train,test}/...`. A mesh is called as in human_seg, which has it
    simplified: its folders and its file below the split, joined by `__`."""
    meshes, segs = root / "meshes", root / "segs"
    labelled = [(path, segs / "train/adobe" / f"{path.stem}.txt") for path in mesh_files(meshes / "train/adobe")]
    for folder, shared in SHARED_LABELS.items():
        labelled += [(path, segs / shared) for path in mesh_files(meshes / folder)]
    bodies = {path.stem: path for path in mesh_files(meshes / "test/shrec")}
    for number, stem in TESTS.items():
        if stem in bodies:
            labelled.append((bodies[stem], segs / f"test/shrec/shrec_{number}_full.txt"))
    if not labelled:
        raise UsageError(f"{root} is not in the layout of the human bodies: no meshes in {meshes}/train or test/")
    table: dict[int | str, int] = {1 + part: part for part in range(len(PARTS))}
    entries = []
    for path, labels in labelled:
        split, *below = path.relative_to(meshes).with_suffix("").parts
        name = "__".join(below).removesuffix("_fix_orientation")
        entries.append(
            Entry(
                id=f"{split}/{name}",
                path=path,
                source=path.relative_to(root).as_posix(),
                split=split,
                group=group_of(name),
                labels=LabelFile(path=labels, form="last-column", classes=table, domains=("face",)),
            )
        )
    folders = ("train/adobe", *SHARED_LABELS)
    return RawDataset(
        name="human_seg_original",
        task="segmentation",
        classes=PARTS,
        entries=tuple(entries),
        notes=(
            *lacking("folders of meshes", folders, [folder for folder in folders if (meshes / folder).is_dir()]),
            *lacking("test bodies", TESTS.values(), bodies),
            *not_read(meshes, entries),
        ),
    )


ADAPTER = Adapter(
    name="human_seg_original",
    page="human_body",
    summary="human bodies as published, 8 parts, 381 + 18 meshes",
    licence=LICENCE,
    citation=CITATION,
    origin="human_benchmark_sig_17.zip of Maron et al., whose folder is sig17_seg_benchmark",
    expected={"train": 381, "test": 18},
    read=read,
)
