"""FAUST and SCAPE for correspondence: the registered meshes, and those remeshed by Ren et al. 2018 (_r).

Registered meshes have the template's own vertices. A remeshed one comes with a .vts file, which names its vertex for
each vertex of a template.
"""

from collections import Counter
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path

from meshshard.errors import UsageError
from meshshard_prep.datasets.layout import Adapter, Entry, RawDataset
from meshshard_prep.datasets.meshcnn import mesh_files
from meshshard_prep.datasets.told import lacking

NAMES = {
    "faust": tuple(f"tr_reg_{number:03}" for number in range(100)),
    "scape": tuple(f"mesh{number:03}" for number in range(72) if number != 51),
}
"""Published meshes, in order; SCAPE has no mesh051."""

TRAIN = {"faust": 80, "scape": 51}
"""How many of them are train; the others, 20 each, are test."""

VERTICES = {"faust": 6890, "scape": 12500}
"""Of the registered meshes."""

FOLDERS = ("training/registrations", "off", "off_2", "shapes", ".")
"""Where meshes may lie below the raw folder: MPI-FAUST, what archives of the remeshed call it, or there itself."""

CORRESPONDENCES = ("corres", "corrs", "correspondences")


def read_registered(root: Path, kind: str) -> RawDataset:
    """Meshes that all have the template's vertices, in its order."""
    return _read(root, kind, kind, lambda path: path, VERTICES[kind])


def read_remeshed(root: Path, kind: str) -> RawDataset:
    """`off/*.off` and `corres/*.vts`. The template has as many vertices as most of the .vts files have lines."""
    folder = _first(root, CORRESPONDENCES)
    size = template_size(folder / f"{name}.vts" for name in NAMES[kind])
    return _read(root, kind, f"{kind}_r", lambda path: folder / f"{path.stem}.vts", size)


def _read(root: Path, kind: str, name: str, file_of: Callable[[Path], Path], template: int) -> RawDataset:
    found = {path.stem: path for path in mesh_files(_first(root, FOLDERS))}
    entries = [
        Entry(
            id=stem,
            path=found[stem],
            source=found[stem].relative_to(root).as_posix(),
            split="train" if place < TRAIN[kind] else "test",
            group=f"subject {stem[-2]}" if kind == "faust" else "",
            correspondence=file_of(found[stem]),
            template=template,
        )
        for place, stem in enumerate(NAMES[kind])
        if stem in found
    ]
    if not entries:
        raise UsageError(f"{root} is not in the layout of {name}: no {NAMES[kind][0]} in {' or '.join(FOLDERS)}")
    strangers = sorted(stem for stem in found if stem not in NAMES[kind])
    return RawDataset(
        name=name,
        task="correspondence",
        classes=(),
        entries=tuple(entries),
        notes=(
            *lacking("meshes", NAMES[kind], found),
            *(f"{stem} is not one of {name}, and was not read" for stem in strangers),
        ),
    )


def template_size(files: Iterable[Path]) -> int:
    """Vertices of the template: the number of lines that most of the files have, 0 for no files."""
    counts = Counter(len(file.read_bytes().rstrip().splitlines()) for file in files if file.is_file())
    return counts.most_common(1)[0][0] if counts else 0


def _first(root: Path, folders: tuple[str, ...]) -> Path:
    """The first folder that is there, else the first."""
    return next((root / folder for folder in folders if (root / folder).is_dir()), root / folders[0])


FAUST = "Bogo et al. 2014, FAUST: Dataset and evaluation for 3D mesh registration"
SCAPE = "Anguelov et al. 2005, SCAPE: Shape Completion and Animation of People"
REMESHED = (
    "remeshed: Ren et al. 2018, Continuous and Orientation-preserving Correspondences via Functional Maps; split: "
    "Donati et al. 2020, Deep Geometric Functional Maps"
)


FAUST_LICENCE = "non-commercial research only, after registration; no redistribution"
SCAPE_LICENCE = "research only, on request; no redistribution"


def _adapter(
    kind: str, name: str, summary: str, licence: str, citation: str, origin: str, read: Callable[..., RawDataset]
) -> Adapter:
    return Adapter(
        name=name,
        page="faust_scape",
        task="correspondence",
        summary=summary,
        licence=licence,
        citation=citation,
        origin=origin,
        expected={"train": TRAIN[kind], "test": 20},
        read=partial(read, kind=kind),
    )


ADAPTERS = (
    _adapter(
        "faust",
        "faust",
        "FAUST, registered: 10 people in 10 poses, 6890 vertices each",
        FAUST_LICENCE,
        FAUST,
        "MPI-FAUST.zip, after registration at faust.is.tue.mpg.de",
        read_registered,
    ),
    _adapter(
        "scape",
        "scape",
        "SCAPE, registered: one person in 71 poses, 12500 vertices each",
        SCAPE_LICENCE,
        SCAPE,
        "the SCAPE pages of Stanford, on request",
        read_registered,
    ),
    _adapter(
        "faust",
        "faust_r",
        "FAUST, remeshed: about 5000 vertices, other ones for each mesh",
        FAUST_LICENCE,
        f"{FAUST}; {REMESHED}",
        "FAUST_r.zip and FAUST_r_vts.zip, which the repository of GeomFMaps links to",
        read_remeshed,
    ),
    _adapter(
        "scape",
        "scape_r",
        "SCAPE, remeshed: about 5000 vertices, other ones for each mesh",
        SCAPE_LICENCE,
        f"{SCAPE}; {REMESHED}",
        "SCAPE_r.zip and SCAPE_r_vts.zip, which the repository of GeomFMaps links to",
        read_remeshed,
    ),
)
