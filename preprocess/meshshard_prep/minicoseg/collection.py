"""Which meshes a generated data set consists of."""

from collections.abc import Iterator
from dataclasses import dataclass

from meshshard_prep.minicoseg.classes import FAMILIES
from meshshard_prep.minicoseg.labelled import LabelledMesh
from meshshard_prep.minicoseg.layout import Defect, Split, split_and_defect
from meshshard_prep.minicoseg.make import make_mesh

FEWEST_FACES, MOST_FACES = 200, 100_000


@dataclass(frozen=True, kw_only=True)
class Collection:
    """`count` meshes, the families in turn. Left as it is, it is minicoseg.

    `faces`: of each mesh, about; None draws from 700 to 1400. `defects`: how a share `damaged` of the meshes is
    damaged, these kinds in turn; None leaves it to minicoseg's plan, which damages one mesh in ten, () damages none.
    ValueError for what cannot be made.
    """

    seed: int = 0
    count: int = 135
    families: tuple[str, ...] = FAMILIES
    faces: int | None = None
    defects: tuple[Defect, ...] | None = None
    damaged: float = 1.0

    def __post_init__(self) -> None:
        if not self.families or not set(self.families) <= set(FAMILIES):
            raise ValueError(f"a family is one of {', '.join(FAMILIES)}, not {', '.join(self.families)}")
        if self.count < 1:
            raise ValueError(f"a data set has one mesh or more, not {self.count}")
        if self.faces is not None and not FEWEST_FACES <= self.faces <= MOST_FACES:
            raise ValueError(f"a mesh has {FEWEST_FACES} to {MOST_FACES} faces, not {self.faces}")
        if not 0 <= self.damaged <= 1:
            raise ValueError(f"the share of damaged meshes is 0 to 1, not {self.damaged}")

    def __iter__(self) -> Iterator[tuple[str, int]]:
        """Family and index of every mesh."""
        families = [family for family in FAMILIES if family in self.families]
        for number in range(self.count):
            yield families[number % len(families)], number // len(families)

    def split(self, family: str, index: int) -> Split:
        """The split that a mesh belongs to: two in three are for training, whatever else is asked for."""
        return split_and_defect(self.seed, family, index)[0]

    def defect(self, family: str, index: int) -> Defect:
        """What is wrong with a mesh; empty where nothing is."""
        if self.defects is None:
            return split_and_defect(self.seed, family, index)[1]
        # every kind of damage and every whole mesh recurs evenly, so that each split has its share of them
        before, now = int(index * self.damaged), int((index + 1) * self.damaged)
        return self.defects[before % len(self.defects)] if self.defects and now > before else ""

    def make(self, family: str, index: int) -> LabelledMesh:
        """One of its meshes."""
        return make_mesh(family, index, self.seed, faces=self.faces, defect=self.defect(family, index))

    def __str__(self) -> str:
        """What was asked for, in words."""
        faces = "" if self.faces is None else f" of about {self.faces} faces"
        if self.defects is None:
            damage = "one in ten damaged on purpose: open, not a manifold, or in several pieces"
        elif self.defects and self.damaged:
            damage = f"{100 * self.damaged:g} in a hundred damaged on purpose: {', '.join(self.defects)}"
        else:
            damage = "none damaged"
        return f"seed {self.seed}, {self.count} meshes{faces}, in turn {', '.join(self.families)}; {damage}"
