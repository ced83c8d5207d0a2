"""minicoseg: a small labelled dataset of chairs, vases and aliens, generated from a seed; in the spirit of COSEG."""

from meshshard_prep.minicoseg.classes import CLASSES, FAMILIES
from meshshard_prep.minicoseg.collection import Collection
from meshshard_prep.minicoseg.generate import generate
from meshshard_prep.minicoseg.labelled import LabelledMesh
from meshshard_prep.minicoseg.layout import split_and_defect
from meshshard_prep.minicoseg.make import make_mesh

__all__ = ["CLASSES", "FAMILIES", "Collection", "LabelledMesh", "generate", "make_mesh", "split_and_defect"]
