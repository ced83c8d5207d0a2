"""The embedded data set: chairs, vases and aliens made from a seed. See `meshshard_prep.minicoseg`."""

from pathlib import Path

from meshshard.errors import UsageError
from meshshard_prep.datasets.layout import Adapter, RawDataset
from meshshard_prep.datasets.meshcnn import read_segmentation


def _generate(root: Path) -> None:
    from meshshard_prep.minicoseg import Collection, generate  # scikit-image takes a second to import

    try:
        generate(root, Collection(), jobs=-1)
    except FileExistsError as error:
        raise UsageError(str(error)) from error


def _read(root: Path) -> RawDataset:
    from meshshard_prep.minicoseg import CLASSES

    return read_segmentation(root, name="minicoseg", classes=CLASSES, first_value=0, domains=("face",))


ADAPTER = Adapter(
    name="minicoseg",
    page="minicoseg",
    summary="generated chairs, vases and aliens, 10 parts, 135 meshes of 500 to 1500 faces",
    licence="none needed: made from a seed",
    citation="meshshard",
    origin="made by `meshshard features minicoseg`; nothing to download",
    expected={"train": 86, "val": 22, "test": 27},
    read=_read,
    generate=_generate,
    is_complete=lambda root: (root / "README.txt").is_file(),  # written last
)
