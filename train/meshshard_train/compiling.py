"""The network by torch.compile: the same training up to rounding, faster once it is compiled."""

import os
import shutil
import sys
from collections.abc import Callable

import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor

from meshshard import UsageError
from meshshard_train.config import TrainConfig
from meshshard_train.model import ROWS, TaskDrivenNet, padded


def compiled(
    network: TaskDrivenNet, config: TrainConfig, device: torch.device, backend: str = "inductor"
) -> Callable[..., Tensor]:
    """A call that trains the network as its own does; its weights stay where they are.

    Rows are padded before the compiled part, which is compiled once, for any number of them. UsageError: layers that
    look at other vertices, whose rows may not be padded; or no C++ compiler, where the processor computes.
    """
    if not config.pointwise:
        raise UsageError(
            "--compile is for networks whose layers see one vertex at a time (normalisation layer, backbone "
            f"mlp_residual or mlp), not for {config.normalisation} and {config.backbone}: leave it out"
        )
    compiler = os.environ.get("CXX", "clang++" if sys.platform == "darwin" else "g++")
    if device.type == "cpu" and not shutil.which(compiler):
        raise UsageError(
            f"--compile needs a C++ compiler, and there is no {compiler}: install one (on Debian: apt install g++), "
            "name yours in the variable CXX, or leave --compile out"
        )
    inner = torch.compile(network, dynamic=True, backend=backend)

    def forward(
        features_VC: Float[Tensor, "V C"],
        mesh_V: Int[Tensor, " V"] | None = None,  # noqa: ARG001
        drop_VL: Float[Tensor, "V L"] | None = None,
        used_V: Bool[Tensor, " V"] | None = None,  # noqa: ARG001
        areas_V: Float[Tensor, " V"] | None = None,  # noqa: ARG001
    ) -> Float[Tensor, "V K"]:
        rows_WC, drop_WL = padded(features_VC, drop_VL, ROWS)
        return inner(rows_WC, None, drop_WL)[: len(features_VC)]

    return forward
