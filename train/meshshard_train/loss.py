"""The loss of a packed batch: the mean over meshes of each mesh's mean. Packing changes nothing but the speed."""

from jaxtyping import Float
from torch import Tensor
from torch.nn import functional

from meshshard_train.data import Batch
from meshshard_train.functional_map import map_losses
from meshshard_train.model import pool_faces, pool_meshes


def logits_of(vertex_logits_VK: Float[Tensor, "V K"], batch: Batch, task: str) -> Float[Tensor, "n K"]:
    """Logits of faces, of vertices or of meshes."""
    if task == "classification":
        return pool_meshes(vertex_logits_VK, batch.mesh_V, batch.used_V, len(batch.numbers))
    return pool_faces(vertex_logits_VK, batch.faces_F3) if task == "segmentation" else vertex_logits_VK


def mesh_losses(
    logits_nK: Float[Tensor, "n K"], batch: Batch, task: str, label_smoothing: float, map_regularisation: float = 0.0
) -> Float[Tensor, " B"]:
    """Cross entropy of each mesh, the mean over its labelled faces or vertices; 0 for a mesh without any. For
    correspondence, whose logits are coordinates, of each pair how far its functional map is off."""
    if task == "correspondence":
        return map_losses(logits_nK, batch.spectra, batch.pairs, map_regularisation).float()
    loss_n = functional.cross_entropy(
        logits_nK.float(), batch.labels, ignore_index=-1, label_smoothing=label_smoothing, reduction="none"
    )
    if task == "classification":
        return loss_n
    mesh_n = batch.mesh_F if task == "segmentation" else batch.mesh_V
    zeros_B = loss_n.new_zeros(len(batch.numbers))
    labelled_B = zeros_B.index_add(0, mesh_n, (batch.labels >= 0).to(loss_n.dtype))
    return zeros_B.index_add(0, mesh_n, loss_n) / labelled_B.clamp(min=1)
