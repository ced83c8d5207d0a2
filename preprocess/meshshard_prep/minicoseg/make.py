"""One mesh of the dataset from its family, index and seed."""

from collections.abc import Callable

import numpy as np

from meshshard_prep.minicoseg.aliens import draw_alien
from meshshard_prep.minicoseg.chairs import draw_chair
from meshshard_prep.minicoseg.classes import FAMILIES
from meshshard_prep.minicoseg.defects import Surface, add_fin, cut_open
from meshshard_prep.minicoseg.labelled import LabelledMesh
from meshshard_prep.minicoseg.layout import Defect, split_and_defect
from meshshard_prep.minicoseg.meshing import COLLAPSING, FINE, FINISHES, MOST, Finish, marching, triangulate
from meshshard_prep.minicoseg.shape import Shape
from meshshard_prep.minicoseg.vases import draw_vase

_DRAW: dict[str, Callable[[np.random.Generator], Shape]] = {
    "chair": draw_chair,
    "vase": draw_vase,
    "alien": draw_alien,
}


def make_mesh(
    family: str, index: int, seed: int = 0, *, faces: int | None = None, defect: Defect | None = None
) -> LabelledMesh:
    """Mesh `index` of a family; all that is random in it comes from (seed, family, index).

    `faces`: about how many; None draws from 700 to 1400. `defect`: what is wrong with it; None leaves that to
    `split_and_defect`. Raises ValueError for a family that is not in FAMILIES.
    """
    if family not in FAMILIES:
        raise ValueError(f"family {family!r} is none of {', '.join(FAMILIES)}")
    rng = np.random.default_rng([seed, FAMILIES.index(family), index])
    if defect is None:
        _, defect = split_and_defect(seed, family, index)
    shape = _DRAW[family](rng)
    drawn = int(rng.integers(700, 1400))
    count, most = (drawn, MOST) if faces is None else (faces, round(1.2 * faces))
    surface = _in_pieces(shape, count, rng) if defect == "pieces" else _in_one(shape, count, rng, most=most)
    if defect == "open":
        surface = cut_open(surface, rng)
    elif defect == "nonmanifold":
        surface = add_fin(surface, rng)
    name = f"{family}_{index:03d}"
    return LabelledMesh(vertices=surface[0], faces=surface[1], labels=surface[2], name=name, defect=defect)


def _in_one(
    shape: Shape, count: int, rng: np.random.Generator, finishes: tuple[Finish, ...] = FINISHES, most: int = MOST
) -> Surface:
    vertices, faces = triangulate(shape, count, rng, finishes, most)
    return vertices, faces, shape.labels(vertices[faces].mean(axis=1))


def _in_pieces(shape: Shape, count: int, rng: np.random.Generator) -> Surface:
    """The parts of one class as surfaces of their own, beside the rest of the shape."""
    loose, rest = shape.apart()
    share = 1 / (1 + len(marching(rest, FINE, rng)[1]) / len(marching(loose, FINE, rng)[1]))
    first = _in_one(loose, int(share * count), rng, COLLAPSING)
    second = _in_one(rest, int((1 - share) * count), rng, COLLAPSING)
    return (
        np.concatenate([first[0], second[0]]),
        np.concatenate([first[1], second[1] + len(first[0])]),
        np.concatenate([first[2], second[2]]),
    )
