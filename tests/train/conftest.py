"""One thread: the tensors of tests are small, and threads that wait for each other are slower than one that works.
And no waiting for the disk: checkpoints are 50 MB, and these tests are not about power cuts."""

import os

import pytest
import torch

torch.set_num_threads(1)


@pytest.fixture(autouse=True, scope="session")
def _disk_is_not_waited_for():
    original, os.fsync = os.fsync, lambda descriptor: None  # noqa: ARG005
    yield
    os.fsync = original
