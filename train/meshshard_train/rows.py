"""Which mesh each row of a packed array is of: sums over a mesh, and neighbours within it, never across meshes.

Shapes: V rows, B meshes, C channels.
"""

from functools import cached_property
from typing import Any

import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor, nn
from torch.nn import functional


class Rows:
    """The rows of `x_VC`: `vertices` of the meshes (None: all), then padding, which takes no part.

    `mesh_V`: the mesh of each vertex, rising from 0 (None: all of one); `used_V`: those that take part (None: all);
    `areas_V`: their areas, in any unit (None: all alike). Nothing is computed before it is asked for: the published
    network, which is pointwise, never asks. (A SymInt is the number in an exported network.)
    """

    def __init__(
        self,
        x_VC: Float[Tensor, "V C"],
        vertices: int | torch.SymInt | None = None,
        mesh_V: Int[Tensor, " n"] | None = None,
        used_V: Bool[Tensor, " n"] | None = None,
        areas_V: Float[Tensor, " n"] | None = None,
    ) -> None:
        self.given_mesh, self.given_used, self.given_areas = mesh_V, used_V, areas_V
        self.rows, self.device = x_VC.shape[0], x_VC.device
        self.vertices: Any = self.rows if vertices is None else vertices  # torch's types know no SymInt

    @cached_property
    def meshes(self) -> int:
        """How many."""
        return 1 if self.given_mesh is None else int(self.given_mesh[-1]) + 1

    @cached_property
    def mesh(self) -> Int[Tensor, " V"]:
        """The mesh whose statistics a row is given; padding is given those of the first."""
        if self.given_mesh is None:
            return torch.zeros(self.rows, dtype=torch.int64, device=self.device)
        return functional.pad(self.given_mesh, (0, self.rows - self.vertices))

    @cached_property
    def counted(self) -> Int[Tensor, " V"]:
        """The mesh that a row counts in; B where it counts in none."""
        used_V = self.given_used
        if used_V is None:
            used_V = torch.ones(self.vertices, dtype=torch.bool, device=self.device)
        return torch.where(functional.pad(used_V, (0, self.rows - self.vertices)), self.mesh, self.meshes)

    @cached_property
    def sizes(self) -> Float[Tensor, "B 1"]:
        """How many rows count in each mesh; 1 where none does."""
        return self.sums(torch.ones(self.rows, 1, device=self.device)).clamp(min=1)

    def sums(self, x_VC: Float[Tensor, "V C"]) -> Float[Tensor, "B C"]:
        """Sum of each mesh's rows."""
        total_BC = x_VC.new_zeros(self.meshes + 1, x_VC.shape[1]).index_add(0, self.counted, x_VC)
        return total_BC[: self.meshes]

    def means(self, x_VC: Float[Tensor, "V C"]) -> Float[Tensor, "B C"]:
        """Mean of each mesh's rows."""
        return self.sums(x_VC) / self.sizes

    @cached_property
    def areas(self) -> Float[Tensor, "V 1"]:
        """Of each row."""
        areas_V = self.given_areas
        if areas_V is None:
            areas_V = torch.ones(self.vertices, device=self.device)
        return functional.pad(areas_V, (0, self.rows - self.vertices))[:, None]

    @cached_property
    def surfaces(self) -> Float[Tensor, "B 1"]:
        """The area of each mesh, of the rows that count."""
        return self.sums(self.areas).clamp(min=1e-30)

    def area_means(self, x_VC: Float[Tensor, "V C"]) -> Float[Tensor, "B C"]:
        """Mean over the surface of each mesh: each row weighs what its area does; 0 for a mesh without area."""
        return self.sums(x_VC * self.areas) / self.surfaces

    def spread(self, values_BC: Float[Tensor, "B C"]) -> Float[Tensor, "V C"]:
        """Each row gets what its mesh has."""
        return values_BC.index_select(0, self.mesh)

    def with_neighbours(self, x_VC: Float[Tensor, "V C"]) -> Float[Tensor, "V 3*C"]:
        """The row before, the row, and the row after; 0 for one that is of another mesh or does not count."""
        and_zeros_VC = functional.pad(x_VC, (0, 0, 0, 1))
        return and_zeros_VC.index_select(0, self.neighbours.flatten()).view(self.rows, 3 * x_VC.shape[1])

    @cached_property
    def neighbours(self) -> Int[Tensor, "V 3"]:
        """Numbers of these rows; V for none."""
        number = torch.arange(self.rows, device=self.device)
        before_V = functional.pad(self.counted, (1, 0), value=-1)[:-1] == self.mesh
        after_V = functional.pad(self.counted, (0, 1), value=-1)[1:] == self.mesh
        before, after = torch.where(before_V, number - 1, self.rows), torch.where(after_V, number + 1, self.rows)
        return torch.stack([before, number, after], 1)


class OfMesh(nn.Module):
    """A layer that looks at other vertices of the mesh: its `forward` takes the rows too."""


class Chain(nn.Sequential):
    """Layers one after the other, of which some may look at other vertices of the mesh."""

    def forward(self, x_VC: Float[Tensor, "V C"], rows: Rows) -> Float[Tensor, "V D"]:  # type: ignore[override]
        """`rows` of the array go to the layers that ask for them."""
        for layer in self:
            x_VC = layer(x_VC, rows) if isinstance(layer, OfMesh) else layer(x_VC)
        return x_VC
