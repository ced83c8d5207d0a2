"""The pointwise residual network of "A Task-driven Network for Mesh Classification and Semantic Part Segmentation".

Shapes: V vertices of all meshes of a batch, F their faces, B meshes, C channels, K classes, L residual blocks.
No layer looks at another vertex: meshes of any size, connectivity or number are packed into one (V, C) array. Layers
of the article's ablations do, within a mesh: see normalisation.py and backbone.py.
"""

import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor, nn
from torch.nn import functional

from meshshard_train.backbone import BACKBONES
from meshshard_train.normalisation import normalisation as norm
from meshshard_train.rows import Chain, Rows

STAGES = (3, 4, 6, 3)
"""Residual blocks of the four encoder stages; the decoder has as many in its four."""
BLOCKS = 2 * sum(STAGES)
ROWS = 256
"""Rows are padded to a multiple of this: the processor's matrix library prepares itself anew for every new number."""


class Block(nn.Module):
    """x + gamma * expand(bottleneck(x)), then ReLU. `scale_V1` is the drop-path factor of each vertex's mesh."""

    def __init__(self, width: int, normalisation: str = "layer", backbone: str = "mlp_residual") -> None:
        super().__init__()
        self.kind, inner = BACKBONES[backbone], width // 4
        self.bottleneck = Chain(
            self.kind.layer(width, inner),
            norm(normalisation, inner),
            nn.ReLU(),
            self.kind.layer(inner, inner),
            norm(normalisation, inner),
            nn.ReLU(),
        )
        self.expand = self.kind.layer(inner, width)
        self.gamma = nn.Parameter(torch.full((width,), self.kind.gamma))

    def forward(
        self, x_VC: Float[Tensor, "V C"], scale_V1: Float[Tensor, "V 1"] | None, rows: Rows
    ) -> Float[Tensor, "V C"]:
        """The residual step; no factor means that no path is dropped."""
        # gamma * (W h + b) with gamma inside the product: the same numbers, without a pass over V x C values
        weight, bias = self.gamma[:, None] * self.expand.weight, self.gamma * self.expand.bias
        inner_VC = self.bottleneck(x_VC, rows)
        if self.kind.convolves:
            inner_VC = rows.with_neighbours(inner_VC)
        branch_VC = functional.linear(inner_VC, weight, bias)
        if not self.kind.residual:
            return functional.relu(branch_VC)
        return functional.relu(x_VC + (branch_VC if scale_V1 is None else scale_V1.to(branch_VC.dtype) * branch_VC))


class Stage(nn.Module):
    """Blocks of one width, one after the other."""

    def __init__(self, width: int, depth: int, normalisation: str = "layer", backbone: str = "mlp_residual") -> None:
        super().__init__()
        self.blocks = nn.ModuleList(Block(width, normalisation, backbone) for _ in range(depth))

    def forward(
        self, x_VC: Float[Tensor, "V C"], scale_VL: Float[Tensor, "V L"] | None, rows: Rows
    ) -> Float[Tensor, "V C"]:
        """`scale_VL` holds a column for each of the stage's blocks."""
        for number, block in enumerate(self.blocks):
            x_VC = block(x_VC, None if scale_VL is None else scale_VL[:, number : number + 1], rows)
        return x_VC


def stem(inputs: int, outputs: int, normalisation: str) -> Chain:
    """Linear, normalisation."""
    return Chain(nn.Linear(inputs, outputs), norm(normalisation, outputs))


def tail(inputs: int, outputs: int, normalisation: str) -> Chain:
    """Normalisation, Linear."""
    return Chain(norm(normalisation, inputs), nn.Linear(inputs, outputs))


class TaskDrivenNet(nn.Module):
    """Vertex features (V, in_features) to vertex logits (V, outputs).

    An encoder of four stages and a decoder that takes the encoder's outputs again, U-Net fashion. Faces and meshes
    take the means of their vertices' logits: see `pool_faces` and `pool_meshes`. 4,101,672 parameters for 25
    features and 8 classes. `normalisation`, `backbone`, `width`: as in `config.TrainConfig`. `pads_to`: the number of
    rows that are computed is a multiple of it.
    """

    def __init__(
        self,
        in_features: int,
        outputs: int,
        normalisation: str = "layer",
        backbone: str = "mlp_residual",
        width: int = 256,
    ) -> None:
        super().__init__()
        self.pads_to, kind = ROWS, (normalisation, backbone)
        half, double = width // 2, 2 * width
        self.stem1, self.stem2 = stem(in_features, width, normalisation), stem(width, double, normalisation)
        encoded = (width, width, width, double)
        self.encoder = nn.ModuleList(Stage(w, d, *kind) for w, d in zip(encoded, STAGES, strict=True))
        self.decoder = nn.ModuleList(Stage(double, depth, *kind) for depth in STAGES)
        self.tails = nn.ModuleList(tail(double, outputs, normalisation) for outputs in (width, width, width, half))
        self.skips = nn.ModuleList(tail(width, half, normalisation) for _ in range(3))
        self.last = tail(double, half, normalisation)
        self.head = Chain(norm(normalisation, half), nn.Linear(half, 32), nn.GELU(), nn.Linear(32, outputs))
        std = 0.02 * (256 / width) ** 0.5  # as published at its width; at others, sums are as large as there
        for module in self.modules():
            if isinstance(module, nn.Linear):
                nn.init.trunc_normal_(module.weight, std=std)
                nn.init.zeros_(module.bias)

    def forward(
        self,
        features_VC: Float[Tensor, "V C"],
        mesh_V: Int[Tensor, " V"] | None = None,
        drop_VL: Float[Tensor, "V L"] | None = None,
        used_V: Bool[Tensor, " V"] | None = None,
        areas_V: Float[Tensor, " V"] | None = None,
    ) -> Float[Tensor, "V K"]:
        """Vertex logits. `mesh_V`: the mesh that each vertex is of, rising from 0; None: all of one. `drop_VL`:
        drop-path factors, encoder blocks first (see `drop_path_factors`); None in evaluation. `used_V`: vertices that
        others may see, where layers look at others; None: all. `areas_V`: how much they count then, where
        normalisation is over surfaces; None: all alike."""
        vertices = features_VC.shape[0]
        features_VC, drop_VL = padded(features_VC, drop_VL, self.pads_to)
        parts = [None] * 8 if drop_VL is None else list(drop_VL.split((*STAGES, *STAGES), dim=1))
        rows = Rows(features_VC, vertices, mesh_V, used_V, areas_V)
        e1 = self.encoder[0](self.stem1(features_VC, rows), parts[0], rows)
        e2 = self.encoder[1](e1, parts[1], rows)
        e3 = self.encoder[2](e2, parts[2], rows)
        e4 = self.encoder[3](self.stem2(e3, rows), parts[3], rows)
        d0 = self.tails[0](e4, rows)
        d1 = self.tails[1](self.decoder[0](torch.cat([e3, d0], 1), parts[4], rows), rows)
        d2 = self.tails[2](self.decoder[1](torch.cat([e2, d1], 1), parts[5], rows), rows)
        d3 = self.tails[3](self.decoder[2](torch.cat([e1, d2], 1), parts[6], rows), rows)
        skips = [skip(d, rows) for skip, d in zip(self.skips, (d2, d1, d0), strict=True)]
        all_scales = torch.cat([d3, *skips], 1)
        logits: Tensor = self.head(self.last(self.decoder[3](all_scales, parts[7], rows), rows), rows)
        return logits[:vertices]


def padded(
    features_VC: Float[Tensor, "V C"], drop_VL: Float[Tensor, "V L"] | None, multiple: int
) -> tuple[Float[Tensor, "W C"], Float[Tensor, "W L"] | None]:
    """Both with rows of zeros behind, so that their number is a multiple."""
    padding = (0, 0, 0, -features_VC.shape[0] % multiple)
    return functional.pad(features_VC, padding), None if drop_VL is None else functional.pad(drop_VL, padding)


def drop_path_rates(rate: float) -> Float[Tensor, " L"]:
    """Probability of dropping each block: from 0 to `rate` over the encoder, and again over the decoder."""
    return torch.linspace(0, rate, BLOCKS // 2).repeat(2)


def drop_path_factors(uniform_BL: Float[Tensor, "B L"], rate: float) -> Float[Tensor, "B L"]:
    """Factors of the residual branches: 0 where dropped, else 1 / (1 - p). One draw for each mesh and block."""
    rates_L = drop_path_rates(rate)
    return (uniform_BL >= rates_L) / (1 - rates_L)


def pool_faces(logits_VK: Float[Tensor, "V K"], faces_F3: Int[Tensor, "F 3"]) -> Float[Tensor, "F K"]:
    """A face's logits are the mean of its three vertices'."""
    return logits_VK.index_select(0, faces_F3.flatten()).view(faces_F3.shape[0], 3, -1).mean(1)


def pool_meshes(
    logits_VK: Float[Tensor, "V K"], mesh_V: Int[Tensor, " V"], used_V: Bool[Tensor, " V"], meshes: int
) -> Float[Tensor, "B K"]:
    """A mesh's logits are the mean of its used vertices', taken in float32 at least. Every mesh has one."""
    kind = torch.promote_types(logits_VK.dtype, torch.float32)  # bfloat16 cannot count to 257
    zeros_BK = logits_VK.new_zeros(meshes, logits_VK.shape[1], dtype=kind)
    used_V1 = used_V[:, None].to(kind)
    return zeros_BK.index_add(0, mesh_V, logits_VK * used_V1) / zeros_BK[:, :1].index_add(0, mesh_V, used_V1)
