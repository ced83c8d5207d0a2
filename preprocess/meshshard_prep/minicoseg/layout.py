"""Which split a mesh belongs to and what is wrong with it: a function of seed, family and index alone.

Every thirty meshes of a family hold 20 of train, 4 of val and 6 of test, one of each among the first three. In every
thirty each split has one damaged mesh of each family, and over the three families one with each defect.
"""

from typing import Literal, get_args

import numpy as np

from meshshard_prep.minicoseg.classes import FAMILIES

Split = Literal["train", "val", "test"]
Defect = Literal["", "open", "nonmanifold", "pieces"]

SPLITS: tuple[Split, ...] = get_args(Split)

DEFECTS: tuple[Defect, ...] = ("open", "nonmanifold", "pieces")
_ROUND = 30
_LATER: tuple[Split, ...] = ("train",) * 19 + ("val",) * 3 + ("test",) * 5
_STREAM = 1  # keeps these draws apart from those of the shapes


def split_and_defect(seed: int, family: str, index: int) -> tuple[Split, Defect]:
    """The place of mesh `index` of the family; the first three of every thirty have no defect."""
    kind = FAMILIES.index(family)
    turn, place = divmod(index, _ROUND)
    rng = np.random.default_rng([seed, kind, turn, _STREAM])
    order = [SPLITS[i] for i in rng.permutation(3)] + [_LATER[i] for i in rng.permutation(len(_LATER))]
    for number, split in enumerate(SPLITS):
        faulty = rng.choice([i for i in range(3, _ROUND) if order[i] == split])
        if faulty == place:
            return split, DEFECTS[(number + kind + turn) % 3]
    return order[place], ""
