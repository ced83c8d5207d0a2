"""The network's input channels from the stored features: scaled in each mesh, in torch, so that an exported network
does the same."""

import torch
from jaxtyping import Bool, Float, Float32
from torch import Tensor

from meshshard import Sample, UsageError
from meshshard_train.config import FEATURES, TrainConfig

TURNED = ("vertices", "vertex_normals")
"""Features that turn with the mesh."""
OF_MANY_SIZES = ("hks", "geodesic", "shape_diameter")
"""Features above 0 whose ratios count: they are brought to one range by their logarithm."""


def input_size(config: TrainConfig, times: int) -> int:
    """Channels of the network's input."""
    return sum(FEATURES[name] or times for name in config.features)


def turned_columns(config: TrainConfig, size: int) -> list[slice]:
    """Where the features that turn with the mesh are among `size` channels."""
    found, start = [], 0
    times = size - input_size(config, 0)
    for name in config.features:
        width = FEATURES[name] or times
        if name in TURNED:
            found.append(slice(start, start + width))
        start += width
    return found


def inputs_of(sample: Sample, config: TrainConfig) -> Float32[Tensor, "V C"]:
    """The channels of a mesh, not turned; rows of unused vertices are 0. UsageError: a feature is not finite."""
    stored = {name: torch.tensor(getattr(sample, name), dtype=torch.float32) for name in config.features}
    areas_V = torch.tensor(sample.vertex_areas, dtype=torch.float32)
    for name, values in (stored | {"vertex_areas": areas_V}).items():
        if not values.isfinite().all():
            raise UsageError(
                f"{sample.id}: {name} is not finite, so its shard is damaged or was written by another program; "
                "meshshard verify --full names all such samples, and meshshard features computes them anew"
            )
    return channels(stored, torch.tensor(sample.used_vertices), areas_V, config.scaling)


def channels(
    stored: dict[str, Float[Tensor, "V ..."]], used_V: Bool[Tensor, " V"], areas_V: Float[Tensor, " V"], scaling: str
) -> Float[Tensor, "V C"]:
    """Stored features, in the order of the channels, side by side. `areas_V`: only scaling log-area asks for it."""
    weights_V = areas_V * used_V if scaling == "log-area" else used_V.float()
    columns = []
    for name, values in stored.items():
        values_VC = values.reshape(used_V.shape[0], -1)
        columns.append(values_VC if name in TURNED else scaled(values_VC, name, used_V, weights_V, scaling))
    return torch.cat(columns, dim=1) * used_V[:, None]


def scaled(
    values_VC: Float[Tensor, "V C"],
    name: str,
    used_V: Bool[Tensor, " V"],
    weights_V: Float[Tensor, " V"],
    scaling: str,
) -> Float[Tensor, "V C"]:
    """Each channel brought to a common range over the used vertices; `weights_V`: how much each counts for mean and
    deviation, 0 for unused ones. A constant channel becomes 0."""
    used_V1 = used_V[:, None]
    if scaling in ("log-standard", "log-area"):
        if name in OF_MANY_SIZES:
            values_VC = values_VC.clamp(min=1e-30).log()
        shares_V1 = (weights_V / weights_V.sum().clamp(min=1e-30))[:, None]
        centre_C = (values_VC * shares_V1).sum(0)
        spread_C = ((values_VC - centre_C).square() * shares_V1).sum(0).sqrt()
    else:
        infinity = torch.tensor(torch.inf, dtype=values_VC.dtype, device=values_VC.device)
        centre_C = torch.where(used_V1, values_VC, infinity).amin(0)
        spread_C = torch.where(used_V1, values_VC, -infinity).amax(0) - centre_C
    # differences below float32's resolution of the value are rounding, not shape
    varies_C = (spread_C > 1e-6 * centre_C.abs().clamp(min=1e-6)) & spread_C.isfinite()
    return torch.where(used_V1 & varies_C, (values_VC - centre_C) / torch.where(varies_C, spread_C, 1), 0)
