"""One thread: the tensors of tests are small, and threads that wait for each other are slower than one that works.
No waiting for the disk: checkpoints are 50 MB, and these tests are not about power cuts. And coarse pictures, except
for tests that ask for `fine_pictures`."""

import os

import pytest
import torch
from program import COARSE_DPI

from meshshard_train import pictures

torch.set_num_threads(1)
FINE_DPI, pictures.DPI = pictures.DPI, COARSE_DPI


@pytest.fixture(autouse=True, scope="session")
def _disk_is_not_waited_for():
    original, os.fsync = os.fsync, lambda descriptor: None  # noqa: ARG005
    yield
    os.fsync = original


@pytest.fixture
def fine_pictures(monkeypatch):
    """Pictures as users get them."""
    monkeypatch.setattr(pictures, "DPI", FINE_DPI)
