"""A mesh and the class of each face."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64, Int64

from meshshard_prep.minicoseg.layout import Defect


@dataclass(frozen=True, eq=False, kw_only=True)
class LabelledMesh:
    """Vertices, faces oriented outwards, and for every face an index into CLASSES; y is up, about one unit tall.

    Without a `defect` it is one closed manifold surface. "open": it has a border. "nonmanifold": some edges have
    three faces. "pieces": several closed surfaces that reach into each other.
    """

    vertices: Float64[np.ndarray, "V 3"]
    faces: Int64[np.ndarray, "F 3"]
    labels: Int64[np.ndarray, " F"]
    name: str
    defect: Defect
