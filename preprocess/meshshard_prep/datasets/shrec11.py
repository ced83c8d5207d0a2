"""SHREC11, 30 classes of 20 non-rigid shapes: simplified as MeshCNN ships it, and dense as published."""

from dataclasses import replace
from pathlib import Path

from meshshard.errors import UsageError
from meshshard_prep.datasets.draws import per_class
from meshshard_prep.datasets.layout import Adapter, Entry, RawDataset
from meshshard_prep.datasets.meshcnn import mesh_files, read_classification
from meshshard_prep.datasets.told import lacking

_NAMES = (
    "alien ants armadillo bird1 bird2 camel cat centaur dino_ske dinosaur dog1 dog2 flamingo glasses gorilla hand "
    "horse lamp laptop man myScissor octopus pliers rabbit santa shark snake spiders two_balls woman"
)
CLASSES = tuple(_NAMES.split())
MESHES = tuple(f"T{number}" for number in range(600))

LICENCE = "research only; no licence stated"
CITATION = "Lian et al. 2011, SHREC'11 Track: Shape Retrieval on Non-rigid 3D Watertight Meshes"


def read_simplified(root: Path) -> RawDataset:
    """MeshCNN's folders, with the split that is shipped."""
    return _checked(read_classification(root, name="shrec_16", classes=CLASSES))


def read_undivided(root: Path) -> RawDataset:
    """The same meshes, in no split."""
    found = read_simplified(root)
    return replace(found, entries=tuple(replace(entry, split="") for entry in found.entries))


def read_dense(root: Path) -> RawDataset:
    """`T<n>.off` beside the track's file of categories, or in a folder beside it. Classes are called and numbered as
    in the simplified archive."""
    lists = sorted(path for path in root.iterdir() if path.name == "categories.txt" or path.suffix == ".cla")
    folders = [root, *sorted(path for path in root.iterdir() if path.is_dir())]
    found = {path.stem: path for folder in folders for path in mesh_files(folder) if path.stem in MESHES}
    if not lists or not found:
        raise UsageError(
            f"{root} is not in the layout of SHREC11: it needs T0.off to T599.off, and the file that says their "
            "classes, categories.txt or a .cla file"
        )
    entries = [
        Entry(
            id=f"{CLASSES[label]}/{name}",
            path=found[name],
            source=found[name].relative_to(root).as_posix(),
            mesh_label=label,
        )
        for name, label in read_categories(lists[0]).items()
        if name in found
    ]
    whole = RawDataset(name="shrec11_dense", task="classification", classes=CLASSES, entries=tuple(entries))
    return _checked(whole)


def read_categories(path: Path) -> dict[str, int]:
    """Mesh -> class, from a file of the Princeton Shape Benchmark's form: `PSB 1`, the numbers of classes and meshes,
    then for each class its name, its parent, its size, and as many lines, each the number of a mesh.

    UsageError names the line: a class that SHREC11 has not, what is no number, a file that ends early.
    """
    content = path.read_text(encoding="utf-8", errors="replace")
    lines = [(n, text.split()) for n, text in enumerate(content.splitlines(), 1) if text.strip()]
    found: dict[str, int] = {}
    label, left = -1, 0
    for number, words in lines[2:]:
        if left:
            if len(words) != 1 or f"T{words[0]}" not in MESHES:
                raise UsageError(
                    f"{path}:{number}: a line is the number of a mesh, 0 to 599, not {' '.join(words)!r}"
                )
            found[f"T{words[0]}"] = label
            left -= 1
            continue
        name = words[0].removesuffix("_test")
        if name not in CLASSES or len(words) != 3 or not words[2].isdigit():
            raise UsageError(
                f"{path}:{number}: a class is its name, its parent and its size, not {' '.join(words)!r}"
            )
        label, left = CLASSES.index(name), int(words[2])
    if left or not found:
        raise UsageError(f"{path} ends within a class; download it again")
    return found


def _checked(found: RawDataset) -> RawDataset:
    stems = {entry.path.stem for entry in found.entries}
    return replace(found, notes=(*found.notes, *lacking("meshes", MESHES, stems)))


SIMPLIFIED = Adapter(
    name="shrec_16",
    page="shrec11",
    task="classification",
    summary="SHREC11, 30 classes, 16 + 4 meshes each as shipped, 500 faces",
    licence=LICENCE,
    citation=CITATION,
    origin="the shrec_16 archive that MeshCNN's scripts/shrec/get_data.sh loads",
    expected={"train": 480, "test": 120, "classes": 30},
    read=read_simplified,
)

UNDIVIDED = replace(SIMPLIFIED, expected={"": 600, "classes": 30}, read=read_undivided, folder="shrec_16")

DENSE = replace(
    UNDIVIDED,
    origin="SHREC11_test_database_new.zip of the track, and its file of categories",
    read=read_dense,
    folder="shrec_11",
)


def _drawn(adapter: Adapter, name: str, train: int) -> Adapter:
    kind = "as published" if adapter is DENSE else "500 faces"
    summary = f"SHREC11, 30 classes, {train} + {20 - train} meshes each drawn by --split-seed, {kind}"
    return replace(adapter, name=name, summary=summary, split=per_class(train))


ADAPTERS = (
    SIMPLIFIED,
    _drawn(UNDIVIDED, "shrec11_split16", 16),
    _drawn(UNDIVIDED, "shrec11_split10", 10),
    _drawn(DENSE, "shrec11_dense_split16", 16),
    _drawn(DENSE, "shrec11_dense_split10", 10),
)
