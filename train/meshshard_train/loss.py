"""The loss of a packed batch: the mean over meshes of each mesh's mean. Packing changes nothing but the speed."""

import torch
from jaxtyping import Float
from torch import Tensor
from torch.nn import functional

from meshshard_train.data import Batch
from meshshard_train.model import pool_faces, pool_meshes


def logits_of(vertex_logits_VK: Float[Tensor, "V K"], batch: Batch, task: str) -> Float[Tensor, "n K"]:
    """Logits of faces (segmentation) or of meshes (classification)."""
    if task == "classification":
        return pool_meshes(vertex_logits_VK, batch.mesh_V, batch.used_V, len(batch.numbers))
    return pool_faces(vertex_logits_VK, batch.faces_F3)


def mesh_losses(
    logits_nK: Float[Tensor, "n K"], batch: Batch, task: str, label_smoothing: float
) -> Float[Tensor, " B"]:
    """Cross entropy of each mesh, the mean over its labelled faces; 0 for a mesh without any."""
    loss_n = functional.cross_entropy(
        logits_nK.float(), batch.labels, ignore_index=-1, label_smoothing=label_smoothing, reduction="none"
    )
    if task == "classification":
        return loss_n
    meshes = len(batch.numbers)
    labelled = torch.zeros(meshes, device=loss_n.device).index_add(0, batch.mesh_F, (batch.labels >= 0).float())
    return torch.zeros_like(labelled).index_add(0, batch.mesh_F, loss_n) / labelled.clamp(min=1)
