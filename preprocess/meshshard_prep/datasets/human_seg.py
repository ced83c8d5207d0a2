"""Human body segmentation as MeshCNN ships it: 381 + 18 meshes of 1500 faces, one label an edge, 8 parts."""

import re

from meshshard_prep.datasets.layout import Adapter
from meshshard_prep.datasets.meshcnn import read_segmentation

PARTS = ("head", "hand", "lower arm", "upper arm", "body", "upper leg", "lower leg", "foot")

LICENCE = "research only; parts derive from FAUST and SCAPE, which forbid redistribution"
CITATION = "Maron et al. 2017, Convolutional Neural Networks on Surfaces via Seamless Toric Covers"


def group_of(stem: str) -> str:
    """The sequence, subject or source of a mesh: frames and poses of one body must not be split.

    Sequences of the MIT animations; subjects of FAUST (ten poses each); SCAPE is one subject; every Adobe and
    SHREC body is its own.
    """
    if found := re.fullmatch(r"MIT_animation__meshes_(\w+?)__meshes__mesh_\d+", stem):
        return f"MIT {found[1]}"
    if found := re.fullmatch(r"faust__tr_reg_0(\d)\d", stem):
        return f"FAUST {found[1]}"
    return "SCAPE" if stem.startswith("scape__") else stem


ADAPTER = Adapter(
    name="human_seg",
    page="human_body",
    summary="human bodies, 8 parts, 381 + 18 meshes of 1500 faces",
    licence=LICENCE,
    citation=CITATION,
    origin="the human_seg archive that MeshCNN's scripts/human_seg/get_data.sh loads",
    expected={"train": 381, "test": 18},
    read=lambda root: read_segmentation(
        root, name="human_seg", classes=PARTS, first_value=1, domains=("edge",), group_of=group_of
    ),
)
