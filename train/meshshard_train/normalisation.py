"""Normalisations in place of the network's LayerNorm, for the article's ablation.

The article names batch, group, global response and instance normalisation, and no more. Our reading: each takes the
place of every LayerNorm, a mesh is the image and its used vertices are the pixels, and nothing else is changed; so
statistics are over the vertices of one mesh, and a mesh packed with others is treated as if it were alone. All have a
weight and a bias for each channel, as LayerNorm has: the number of parameters is the same.

B meshes, V vertices, C channels, G groups of channels.
"""

from collections.abc import Callable
from functools import partial
from math import gcd

import torch
from jaxtyping import Float
from torch import Tensor, nn
from torch.nn import functional

from meshshard_train.rows import OfMesh, Rows

EPS = 1e-6
"""Of the published LayerNorm, and of all of them."""
GROUPS = 32
"""Of group normalisation, as in Wu and He 2018; the article does not say. Fewer where groups would have less than two
channels."""
MOMENTUM = 0.1
"""Share of a mesh in the running averages of batch normalisation: torch's."""


def normalisation(name: str, width: int) -> nn.Module:
    """A layer by its name in `config.NORMALISATIONS`, for `width` channels."""
    kinds: dict[str, Callable[[int], nn.Module]] = {
        "layer": partial(nn.LayerNorm, eps=EPS),
        "batch": BatchNorm,
        "group": partial(GroupNorm, groups=gcd(GROUPS, width // 2)),
        "instance": InstanceNorm,
        "instance_area": AreaInstanceNorm,
        "grn": GlobalResponseNorm,
    }
    return kinds[name](width)


class GroupNorm(OfMesh):
    """Mean 0 and variance 1 over the vertices of a mesh and the channels of a group together; then weight and bias.

    Of one mesh, torch's GroupNorm of an array (1, C, V).
    """

    def __init__(self, width: int, groups: int) -> None:
        super().__init__()
        self.groups = groups
        self.weight, self.bias = nn.Parameter(torch.ones(width)), nn.Parameter(torch.zeros(width))

    def forward(self, x_VC: Float[Tensor, "V C"], rows: Rows) -> Float[Tensor, "V C"]:
        """Statistics are in float32 at least."""
        values_VC = x_VC.to(torch.promote_types(x_VC.dtype, torch.float32))
        mean_BC = self._of_group(self._means(values_VC, rows))
        centred_VC = values_VC - rows.spread(mean_BC)
        variance_BC = self._of_group(self._means(centred_VC.square(), rows))
        self._saw(mean_BC, variance_BC, rows)
        factor_BC = (variance_BC + EPS).rsqrt() * self.weight
        return (centred_VC * rows.spread(factor_BC) + self.bias).to(x_VC.dtype)

    def _means(self, x_VC: Float[Tensor, "V C"], rows: Rows) -> Float[Tensor, "B C"]:
        """Of each mesh."""
        return rows.means(x_VC)

    def _of_group(self, mean_BC: Float[Tensor, "B C"]) -> Float[Tensor, "B C"]:
        """Each channel gets the mean of its group."""
        meshes, width = mean_BC.shape
        mean_BG1 = mean_BC.view(meshes, self.groups, -1).mean(2, keepdim=True)
        return mean_BG1.expand(-1, -1, width // self.groups).reshape(meshes, width)

    def _saw(self, mean_BC: Float[Tensor, "B C"], variance_BC: Float[Tensor, "B C"], rows: Rows) -> None:
        """Told of the statistics of each mesh."""


class InstanceNorm(GroupNorm):
    """Mean 0 and variance 1 over the vertices of a mesh, in each channel; the same in evaluation.

    Of one mesh, torch's InstanceNorm1d(affine=True) of an array (1, C, V).
    """

    def __init__(self, width: int) -> None:
        super().__init__(width, groups=width)


class AreaInstanceNorm(InstanceNorm):
    """Mean 0 and variance 1 over the surface of a mesh, in each channel: where it has many vertices does not matter.
    Not of the article."""

    def _means(self, x_VC: Float[Tensor, "V C"], rows: Rows) -> Float[Tensor, "B C"]:
        return rows.area_means(x_VC)


class BatchNorm(InstanceNorm):
    """In training as instance normalisation, which is what a batch of one mesh has: the published code trains with
    such. In evaluation by running averages of mean and (unbiased) variance over meshes.

    The averages move by a tenth for each mesh, in the order of the meshes in the batches: as if every mesh were a
    batch. So they do not depend on how meshes are packed. Of one mesh, torch's BatchNorm1d of an array (V, C).
    """

    running_mean: Tensor
    running_var: Tensor

    def __init__(self, width: int) -> None:
        super().__init__(width)
        self.register_buffer("running_mean", torch.zeros(width))
        self.register_buffer("running_var", torch.ones(width))

    def forward(self, x_VC: Float[Tensor, "V C"], rows: Rows) -> Float[Tensor, "V C"]:
        """By the statistics of each mesh in training, by the running averages in evaluation."""
        if self.training:
            return super().forward(x_VC, rows)
        values_VC = x_VC.to(self.running_mean.dtype)
        found_VC = functional.batch_norm(
            values_VC, self.running_mean, self.running_var, self.weight, self.bias, eps=EPS
        )
        return found_VC.to(x_VC.dtype)

    @torch.no_grad()
    def _saw(self, mean_BC: Float[Tensor, "B C"], variance_BC: Float[Tensor, "B C"], rows: Rows) -> None:
        unbiased_BC = variance_BC * rows.sizes / (rows.sizes - 1).clamp(min=1)
        later_B1 = torch.arange(rows.meshes - 1, -1, -1, device=mean_BC.device)[:, None]
        share_B1 = MOMENTUM * (1 - MOMENTUM) ** later_B1
        for average, found_BC in ((self.running_mean, mean_BC), (self.running_var, unbiased_BC)):
            average.mul_((1 - MOMENTUM) ** rows.meshes).add_((share_B1 * found_BC).sum(0))


class GlobalResponseNorm(OfMesh):
    """x + weight * x * N + bias, where N is the length of a channel over the vertices of a mesh, divided by the mean
    length of all channels (Woo et al. 2023, ConvNeXt V2). Weight and bias start at 0, as there: it starts as nothing.
    """

    def __init__(self, width: int) -> None:
        super().__init__()
        self.weight, self.bias = nn.Parameter(torch.zeros(width)), nn.Parameter(torch.zeros(width))

    def forward(self, x_VC: Float[Tensor, "V C"], rows: Rows) -> Float[Tensor, "V C"]:
        """Lengths are in float32 at least."""
        values_VC = x_VC.to(torch.promote_types(x_VC.dtype, torch.float32))
        square_BC = rows.sums(values_VC.square())
        alive_BC = square_BC > 0  # the root of 0 has no derivative
        length_BC = torch.where(alive_BC, square_BC, 1).sqrt() * alive_BC
        response_BC = length_BC / (length_BC.mean(1, keepdim=True) + EPS)
        return (values_VC * (1 + rows.spread(self.weight * response_BC)) + self.bias).to(x_VC.dtype)
