"""Dataclasses of tensors that move as one: to a device, or into pinned memory."""

from collections.abc import Callable
from dataclasses import fields, replace
from typing import Any

import torch
from torch import Tensor


class OfTensors:
    """A dataclass of tensors, of such dataclasses, or of tuples of them."""

    def to(self, device: torch.device) -> Any:
        """The same on another device; a pinned one is copied while the caller goes on."""
        return _each(self, lambda tensor: tensor.to(device, non_blocking=True))

    def pin_memory(self) -> Any:
        """The same in memory that a GPU can fetch from by itself."""
        return _each(self, lambda tensor: tensor.pin_memory())


def _each(value: Any, change: Callable[[Tensor], Tensor]) -> Any:
    if isinstance(value, Tensor):
        return change(value)
    if isinstance(value, tuple):
        return tuple(_each(part, change) for part in value)
    if isinstance(value, OfTensors):
        names = [f.name for f in fields(value)]  # type: ignore[arg-type]
        return replace(value, **{name: _each(getattr(value, name), change) for name in names})  # type: ignore[type-var]
    return value
