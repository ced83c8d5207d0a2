"""One mesh as the network takes it, and the part of it that a step of training computes.

Neighbouring vertices teach nearly the same. A network without convolutions can learn from a drawn part of each mesh:
a step then costs that part, and there are as many steps, each of as many meshes.
"""

from dataclasses import dataclass, replace

import numpy as np
import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor

from meshshard_train.config import TrainConfig
from meshshard_train.spectra import Spectrum
from meshshard_train.tensors import OfTensors


@dataclass(frozen=True, eq=False, kw_only=True)
class Prepared(OfTensors):
    """One mesh as the network takes it, before augmentation. `labels`: -1 is not known and not learned."""

    features_VC: Float[Tensor, "V C"]
    used_V: Bool[Tensor, " V"]
    areas_V: Float[Tensor, " V"]
    faces_F3: Int[Tensor, "F 3"]
    labels: Int[Tensor, " n"]
    spectra: tuple[Spectrum, ...] = ()


def drawn_part(mesh: Prepared, rng: np.random.Generator, config: TrainConfig) -> Prepared:
    """At most `vertex_fraction` of the vertices, but one face or vertex at least. Of faces with labels, as many are
    drawn as have so many corners, and their corners are taken; else vertices with labels, or used ones where the
    mesh has the label. Over draws the loss is that of the whole. Where nothing has a label, anything is drawn."""
    wanted = config.vertex_fraction * len(mesh.used_V)
    if config.task == "segmentation":
        faces = _drawn(rng, mesh.labels >= 0, int(wanted) // 3)
        kept_V, corners = mesh.faces_F3[faces].unique(return_inverse=True)
        part = replace(mesh, faces_F3=corners.view(-1, 3), labels=mesh.labels[faces])
    else:
        of_mesh = config.task == "classification"
        kept_V = _drawn(rng, mesh.used_V if of_mesh else mesh.labels >= 0, int(wanted))
        labels = mesh.labels if of_mesh else mesh.labels[kept_V]
        part = replace(mesh, faces_F3=mesh.faces_F3[:0], labels=labels)
    return replace(
        part, features_VC=mesh.features_VC[kept_V], used_V=mesh.used_V[kept_V], areas_V=mesh.areas_V[kept_V]
    )


def _drawn(rng: np.random.Generator, eligible_n: Bool[Tensor, " n"], wanted: int) -> Int[Tensor, " k"]:
    """Places of `wanted` of the eligible, or of all where none is, each at most once, rising; one at least."""
    places = (
        eligible_n.nonzero()[:, 0] if eligible_n.any() else torch.arange(len(eligible_n), device=eligible_n.device)
    )
    taken = np.sort(rng.permutation(len(places))[: max(wanted, 1)])
    return places[torch.from_numpy(taken).to(places.device)]
