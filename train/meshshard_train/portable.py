"""A trained network as one module from the fields of a mesh, as shards store them, to probabilities."""

import torch
from jaxtyping import Float, Int
from torch import Tensor, nn

from meshshard import Sample
from meshshard_train.checkpoint import Checkpoint
from meshshard_train.config import FEATURES
from meshshard_train.inputs import channels
from meshshard_train.model import pool_faces, pool_meshes

OUTPUTS = {
    "segmentation": ("probabilities", "of each class, a row for each face"),
    "vertex_segmentation": ("probabilities", "of each class, a row for each vertex"),
    "classification": ("probabilities", "of each class, one row for the mesh"),
    "correspondence": ("coordinates", "functional coordinates, a row for each vertex"),
}
"""Task -> name of the output, and what it is."""


class Portable(nn.Module):
    """One mesh a call, in float32. It scales its inputs itself, as training did; vertices without features (those
    whose heat kernel signature is 0) take no part. `inputs`: names of the fields that `forward` takes; the signature
    is always among them."""

    def __init__(self, best: Checkpoint) -> None:
        super().__init__()
        self.network, self.config = best.network(), best.config
        self.network.pads_to = 1
        self.times = len(best.recipe.times)
        self.inputs = [name for name in FEATURES if name in (*self.config.features, "hks")]
        if self.config.scaling == "log-area" or self.config.normalisation == "instance_area":
            self.inputs.append("vertex_areas")
        if self.config.task == "segmentation":
            self.inputs.append("faces")

    def forward(
        self,
        *,
        hks: Float[Tensor, "V T"],
        vertices: Float[Tensor, "V 3"] | None = None,
        vertex_normals: Float[Tensor, "V 3"] | None = None,
        dihedral: Float[Tensor, " V"] | None = None,
        geodesic: Float[Tensor, "V 10"] | None = None,
        shape_diameter: Float[Tensor, "V 2"] | None = None,
        dihedral_signed: Float[Tensor, " V"] | None = None,
        dihedral_official: Float[Tensor, "V 3"] | None = None,
        vertex_areas: Float[Tensor, " V"] | None = None,
        faces: Int[Tensor, "F 3"] | None = None,
    ) -> Float[Tensor, "n K"]:
        """What `OUTPUTS` says. Fields as in `meshshard.Sample`, those that `inputs` names."""
        fields = {
            "vertices": vertices,
            "vertex_normals": vertex_normals,
            "dihedral": dihedral,
            "hks": hks,
            "geodesic": geodesic,
            "shape_diameter": shape_diameter,
            "dihedral_signed": dihedral_signed,
            "dihedral_official": dihedral_official,
        }
        stored = {name: values for name in self.config.features if (values := fields[name]) is not None}
        used_V = hks[:, 0] > 0
        areas_V = used_V.float() if vertex_areas is None else vertex_areas
        logits = self.network(channels(stored, used_V, areas_V, self.config.scaling), None, None, used_V, areas_V)
        if self.config.task == "correspondence":
            return logits
        if self.config.task == "classification":
            logits = pool_meshes(logits, torch.zeros_like(used_V, dtype=torch.int64), used_V, 1)
        elif faces is not None:
            logits = pool_faces(logits, faces)
        return logits.softmax(1)

    def fields_of(self, sample: Sample) -> dict[str, Tensor]:
        """The inputs of a stored mesh."""
        return {name: torch.tensor(getattr(sample, name)) for name in self.inputs}

    def random_fields(self, vertices: int, faces: int, seed: int) -> dict[str, Tensor]:
        """The inputs of no mesh at all, with plausible ranges; the last vertex is unused."""
        generator = torch.Generator().manual_seed(seed)
        found: dict[str, Tensor] = {}
        for name in self.inputs:
            if name == "faces":
                found[name] = torch.randint(0, vertices - 1, (faces, 3), generator=generator).to(torch.int32)
                continue
            if name == "vertex_areas":
                found[name] = torch.rand(vertices, generator=generator)
                continue
            width = FEATURES[name] or self.times
            values_VC = torch.rand(vertices, width, generator=generator) * 2 - (0 if name == "hks" else 1)
            values_VC[-1] = 0
            found[name] = values_VC[:, 0] if FEATURES[name] == 1 else values_VC
        return found
