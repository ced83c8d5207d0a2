"""PyTorch Geometric warns about torch.jit while it is imported. What comes after may not warn."""

import importlib
import warnings


def import_pyg() -> None:
    """Import it, so that later imports find it imported."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "`torch.jit.script` is deprecated", DeprecationWarning)
        importlib.import_module("torch_geometric.loader")
