"""ModelNet10, ModelNet40, and Manifold40, which is ModelNet40 made watertight: `<class>/{train,test}/*`."""

from functools import partial

from meshshard_prep.datasets.layout import Adapter
from meshshard_prep.datasets.meshcnn import read_classification

_OF_10 = "bathtub bed chair desk dresser monitor night_stand sofa table toilet"
_OF_40 = (
    "airplane bathtub bed bench bookshelf bottle bowl car chair cone cup curtain desk door dresser flower_pot "
    "glass_box guitar keyboard lamp laptop mantel monitor night_stand person piano plant radio range_hood sink sofa "
    "stairs stool table tent toilet tv_stand vase wardrobe xbox"
)
LICENCE = "academic research only; the models belong to their authors"
CITATION = "Wu et al. 2015, 3D ShapeNets: A Deep Representation for Volumetric Shapes"


def _adapter(
    name: str, classes: str, summary: str, origin: str, train: int, test: int, citation: str = CITATION
) -> Adapter:
    known = tuple(classes.split())
    return Adapter(
        name=name,
        page="modelnet",
        task="classification",
        summary=summary,
        licence=LICENCE,
        citation=citation,
        origin=origin,
        expected={"train": train, "test": test, "classes": len(known)},
        read=partial(read_classification, name=name, classes=known),
    )


ADAPTERS = (
    _adapter(
        "manifold40",
        _OF_40,
        "Manifold40: ModelNet40 made watertight, 40 classes, 500 faces",
        "the Manifold40 archive of SubdivNet",
        9843,
        2468,
        f"Hu et al. 2022, Subdivision-based Mesh Convolution Networks; {CITATION}",
    ),
    _adapter("modelnet40", _OF_40, "ModelNet40, 40 classes, as published", "ModelNet40.zip of Princeton", 9843, 2468),
    _adapter("modelnet10", _OF_10, "ModelNet10, 10 classes, as published", "ModelNet10.zip of Princeton", 3991, 908),
)
