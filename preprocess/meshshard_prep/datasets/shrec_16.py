"""SHREC11 as MeshCNN ships it: 30 classes of 16 + 4 meshes of 500 faces."""

from meshshard_prep.datasets.layout import Adapter
from meshshard_prep.datasets.meshcnn import read_classification

ADAPTER = Adapter(
    name="shrec_16",
    summary="30 classes of non-rigid shapes, 480 + 120 meshes of 500 faces",
    licence="research only; no licence stated",
    citation="Lian et al. 2011, SHREC'11 Track: Shape Retrieval on Non-rigid 3D Watertight Meshes",
    origin="the shrec_16 archive that MeshCNN's scripts/shrec/get_data.sh loads",
    expected={"train": 480, "test": 120, "classes": 30},
    read=lambda root: read_classification(root, name="shrec_16"),
)
