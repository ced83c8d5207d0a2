"""One thread: the tensors of tests are small, and threads that wait for each other are slower than one that works."""

import torch

torch.set_num_threads(1)
