"""Labels of faces, edges or vertices: how they are written, what they count, what they are converted to."""

from meshshard_prep.labels.classes import MOST_CLASSES, class_table
from meshshard_prep.labels.forms import FORMS, offered
from meshshard_prep.labels.label_file import LabelFile
from meshshard_prep.labels.of_mesh import Labels, labels_of, listed, read_labels
from meshshard_prep.labels.written import UNLABELLED, Written

__all__ = [
    "FORMS",
    "MOST_CLASSES",
    "UNLABELLED",
    "LabelFile",
    "Labels",
    "Written",
    "class_table",
    "labels_of",
    "listed",
    "offered",
    "read_labels",
]
