"""Known addresses. Each was read in the public files that `read_in` names; no test loads any of them.

Dropbox's addresses end in `dl=1` here, which gives the file; without it a program may get a page about the file.
"""

from typing import TYPE_CHECKING

from meshshard_prep.fetch.source import Archive, Source

if TYPE_CHECKING:
    from meshshard_prep.datasets.layout import Adapter

PAPER = "github.com/QiujieDong/TaskDrivenNet2Mesh: data/README.md"
MESHCNN = "github.com/ranahanocka/MeshCNN"
DIFFUSIONNET = "github.com/nmwsharp/diffusion-net"
PYG = "github.com/pyg-team/pytorch_geometric: torch_geometric/datasets/modelnet.py"


def _coseg_original(sets: dict[str, str]) -> Source:
    """Two archives of each set; `sets`: folder below data/raw/NAME -> name of the set at the address."""
    return Source(
        page="http://irc.cs.sdu.edu.cn/~yunhai/public_html/ssl/ssd.htm",
        read_in="github.com/eidosmontreal/shape-analysis: preprocess/coseg/download_data.py",
        archives=tuple(
            Archive(
                file=f"{published}-{archive}.zip",
                url=f"http://irc.cs.sdu.edu.cn/~yunhai/public_html/ssl/data/{published}/{archive}.zip",
                holds=holds,
                into=f"{folder}/{archive}",
            )
            for folder, published in sets.items()
            for archive, holds in (("shapes", "*.off"), ("gt", "*.seg"))
        ),
    )


def _remeshed(name: str, shapes: int, correspondence: int) -> Source:
    """FAUST or SCAPE: meshes, and the vertex of each at each vertex of the template. Sizes in bytes."""
    return Source(
        page="https://nuage.lix.polytechnique.fr/index.php/s/LJFXrsTG22wYCXx",
        read_in=f"{DIFFUSIONNET}: experiments/functional_correspondence/README.md; {PAPER}",
        archives=(
            Archive(file=f"{name}_r.zip", holds="*.off", into="off", size=shapes),
            Archive(file=f"{name}_r_vts.zip", holds="*.vts", into="corres", size=correspondence),
        ),
        by_hand=f"mark {name}_r.zip and {name}_r_vts.zip and download them",
    )


COSEG = Source(
    page="https://github.com/MIT-SPARK/PD-MeshNet",
    read_in=f"{PAPER}; github.com/MIT-SPARK/PD-MeshNet: pd_mesh_net/datasets/coseg_dual_primal.py",
    archives=(
        Archive(
            file="coseg.zip",
            url="https://www.dropbox.com/s/zro2o7y42wag5yp/coseg.zip?dl=1",
            holds="coseg_*/train",
        ),
    ),
)

SOURCES = {
    "human_seg": Source(
        page="https://github.com/ranahanocka/MeshCNN",
        read_in=f"{MESHCNN}: scripts/human_seg/get_data.sh",
        archives=(
            Archive(
                file="human_seg.tar.gz",
                url="https://www.dropbox.com/s/s3n05sw0zg27fz3/human_seg.tar.gz?dl=1",
                holds="train",
            ),
        ),
    ),
    "human_seg_original": Source(
        page="https://www.dropbox.com/sh/cnyccu3vtuhq1ii/AADgGIN6rKbvWzv0Sh-Kr417a?dl=0",
        read_in=f"{DIFFUSIONNET}: experiments/human_segmentation_original/README.md; {PAPER}",
        archives=(Archive(file="human_benchmark_sig_17.zip", holds="meshes/train"),),
        by_hand="download human_benchmark_sig_17.zip",
    ),
    "shrec_16": Source(
        page="https://github.com/ranahanocka/MeshCNN",
        read_in=f"{MESHCNN}: scripts/shrec/get_data.sh",
        archives=(
            Archive(
                file="shrec_16.tar.gz",
                url="https://www.dropbox.com/s/w16st84r6wc57u7/shrec_16.tar.gz?dl=1",
                holds="*/train",
            ),
        ),
    ),
    "shrec_11": Source(
        page="https://drive.google.com/uc?export=download&id=1O_P03aAxhjCOKQH2n71j013-EfSmEp5e",
        read_in=f"{DIFFUSIONNET}: experiments/classification_shrec11/README.md; {PAPER}",
        by_hand=(
            "unpack what it gives, in there SHREC11_test_database_new.zip with the password that DiffusionNet's "
            "experiments/classification_shrec11/README.md tells, and make its folder data/raw/shrec_11"
        ),
    ),
    "cubes": Source(
        page="https://github.com/ranahanocka/MeshCNN",
        read_in=f"{MESHCNN}: scripts/cubes/get_data.sh",
        archives=(
            Archive(
                file="cubes.tar.gz",
                url="https://www.dropbox.com/s/2bxs5f9g60wa0wr/cubes.tar.gz?dl=1",
                holds="*/train",
            ),
        ),
    ),
    "coseg": COSEG,
    "coseg_aliens": COSEG,
    "coseg_chairs": COSEG,
    "coseg_vases": COSEG,
    "coseg_original": _coseg_original(
        {"tele-aliens": "Tele-aliens", "chairs": "Large-Chairs", "vases": "Large-Vases"}
    ),
    "manifold40": Source(
        page="https://github.com/lzhengning/SubdivNet",
        read_in="github.com/lzhengning/SubdivNet: README.md",
        archives=(
            Archive(
                file="Manifold40.zip",
                url="https://cg.cs.tsinghua.edu.cn/dataset/subdivnet/datasets/Manifold40.zip",
                holds="*/train",
            ),
        ),
    ),
    "modelnet10": Source(
        page="https://modelnet.cs.princeton.edu/",
        read_in=PYG,
        archives=(
            Archive(
                file="ModelNet10.zip",
                url="http://vision.princeton.edu/projects/2014/3DShapeNets/ModelNet10.zip",
                holds="*/train",
            ),
        ),
    ),
    "modelnet40": Source(
        page="https://modelnet.cs.princeton.edu/",
        read_in=PYG,
        archives=(
            Archive(
                file="ModelNet40.zip",
                url="http://modelnet.cs.princeton.edu/ModelNet40.zip",
                holds="*/train",
            ),
        ),
    ),
    "intra": Source(
        page="https://drive.google.com/drive/folders/1yjLdofRRqyklgwFOC0K4r7ee1LPKstPh",
        read_in=f"github.com/intra3d2019/IntrA: README.md; {PAPER}",
        archives=(Archive(file="IntrA.zip", holds="annotated", beside="fileSplit"),),
        by_hand=(
            "download the whole folder, which comes as one zip file or several, and from "
            "https://github.com/intra3d2019/IntrA the zip file of the repository, which has the folds; name them all"
        ),
    ),
    "faust": Source(
        page="http://faust.is.tue.mpg.de/",
        read_in=PAPER,
        archives=(Archive(file="MPI-FAUST.zip", holds="tr_reg_*.ply", into="training/registrations"),),
        by_hand="sign up, accept the licence, download MPI-FAUST.zip",
    ),
    "scape": Source(
        page="http://ai.stanford.edu/~drago/Projects/scape/scape.html",
        read_in=PAPER,
        by_hand="ask for the registered meshes, and put their files into data/raw/scape",
    ),
    "faust_r": _remeshed("FAUST", 19_843_377, 2_185_404),
    "scape_r": _remeshed("SCAPE", 14_224_946, 1_581_854),
    "psb": Source(
        page="https://people.cs.umass.edu/~kalo/papers/LabelMeshes/",
        read_in="github.com/Denbergvanthijs/INFOMR: README.md; github.com/Aed3r/MultimediaRetrieval: README.md",
        by_hand="download labeledDb.7z, type `7z x labeledDb.7z`, and make its folder LabeledDB_new data/raw/psb",
    ),
}
"""Folder of raw files, which is the data set's name or one that several share -> where they are published."""


def source_of(adapter: "Adapter") -> Source | None:
    """Where the raw files of a data set are published; None where nothing is to be fetched."""
    return SOURCES.get(adapter.folder or adapter.name)
