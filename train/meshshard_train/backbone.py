"""What the blocks consist of: the published residual MLP, or one of the article's ablations.

The article names MLP and convolution, each with and without residual, and no more. Our reading: `conv` puts a
convolution of width 3 over the vertices of a mesh, in their order in the file, in place of each Linear layer of the
blocks; stems, tails and head stay. Without residual the block's sum is left out: its output is
ReLU(gamma * branch), and no path is dropped, for there is no other. With 25 inputs and 8 classes the networks of
convolutions have 10,663,464 parameters, the others 4,101,672.

`gamma` starts at 1e-6, as published, but at 1 in `conv`. With 1e-6 and no sum nothing of the input gets through, and
the stem's gradient is 0: such a network cannot learn. That would explain the article's 25.2 % for the plain MLP (the
largest class of that test split has 25.24 % of its faces); but its convolution without residual learned: 84.0 %.
"""

from dataclasses import dataclass

from jaxtyping import Float
from torch import Tensor, nn
from torch.nn import functional

from meshshard_train.rows import OfMesh, Rows


@dataclass(frozen=True)
class Backbone:
    """`convolves`: layers of the blocks see the vertex before and after; `residual`: blocks add to their input."""

    convolves: bool
    residual: bool
    gamma: float = 1e-6

    def layer(self, inputs: int, outputs: int) -> nn.Linear:
        """A layer of a block."""
        return MeshConv(inputs, outputs) if self.convolves else nn.Linear(inputs, outputs)


BACKBONES = {
    "mlp_residual": Backbone(convolves=False, residual=True),
    "mlp": Backbone(convolves=False, residual=False),
    "conv_residual": Backbone(convolves=True, residual=True),
    "conv": Backbone(convolves=True, residual=False, gamma=1.0),
}


class MeshConv(OfMesh, nn.Linear):
    """A convolution of width 3 over the vertices of each mesh; before the first and after the last one is 0.

    `weight` is (outputs, 3 * inputs): for the vertex before, the vertex, and the vertex after. Of one mesh, torch's
    Conv1d(inputs, outputs, 3, padding=1) of an array (1, C, V).
    """

    def __init__(self, inputs: int, outputs: int) -> None:
        super().__init__(3 * inputs, outputs)

    def forward(self, x_VC: Float[Tensor, "V C"], rows: Rows) -> Float[Tensor, "V D"]:  # type: ignore[override]
        """A neighbour that is of another mesh, or unused, counts as 0."""
        return functional.linear(rows.with_neighbours(x_VC), self.weight, self.bias)
