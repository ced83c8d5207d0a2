"""Cubes with engraved icons, as MeshCNN ships them: the folder is the class."""

from meshshard_prep.datasets.layout import Adapter
from meshshard_prep.datasets.meshcnn import read_classification

ADAPTER = Adapter(
    name="cubes",
    page="cubes",
    task="classification",
    summary="cubes with an engraved icon, 22 classes",
    licence="no licence stated; the icons are those of MPEG-7",
    citation="Hanocka et al. 2019, MeshCNN: A Network with an Edge",
    origin="the cubes archive that MeshCNN's scripts/cubes/get_data.sh loads",
    expected={"train": 3722, "test": 659, "classes": 22},
    read=lambda root: read_classification(root, name="cubes"),
)
