import json
import math
import subprocess
import sys
from dataclasses import replace

import pytest
import torch
from samples import toy_dataset

from meshshard import UsageError
from meshshard_train.checkpoint import network_for
from meshshard_train.compiling import compiled
from meshshard_train.recipes import paper

CPU = torch.device("cpu")
CONFIG = paper("segmentation", width=16, epochs=2, batch_vertices=150, precision="fp32")

SCRIPT = """
import json, sys
from functools import partial
from pathlib import Path
import torch
from meshshard import open_dataset
from meshshard_train import compiling, loop
from meshshard_train.config import TrainConfig

def stop(progress):
    if progress.epoch == 1:
        raise KeyboardInterrupt

torch.set_num_threads(1)
loop.compiled = partial(compiling.compiled, backend="eager")  # its translation to C++ takes minutes
folder, config, device = Path(sys.argv[1]), TrainConfig.from_json(sys.argv[2]), torch.device("cpu")
dataset = open_dataset(folder / "data")
plain = loop.train(dataset, config, folder / "plain", device)
try:
    loop.train(dataset, config, folder / "mixed", device, stop, compiling=True)
except KeyboardInterrupt:
    pass
mixed = loop.train(dataset, config, folder / "mixed", device)
graphs = torch._dynamo.utils.counters["stats"]["unique_graphs"]
print(json.dumps([graphs, *([row["loss"] for row in history] for history in (plain, mixed))]))
"""


def test_a_compiled_training_has_the_same_losses_and_goes_on_without(tmp_path):
    # in a process of its own: torch.compile cannot look through the checks of shapes that are on in tests
    toy_dataset(tmp_path / "data")
    call = [sys.executable, "-c", SCRIPT, str(tmp_path), CONFIG.to_json()]
    done = subprocess.run(call, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    graphs, plain, mixed = json.loads(done.stdout)
    assert (graphs, len(plain), len(mixed)) == (1, 2, 2)  # all steps are padded to as many rows
    assert all(math.isclose(one, other, rel_tol=1e-5) for one, other in zip(plain, mixed, strict=True))


def test_what_cannot_be_compiled_is_told(monkeypatch):
    network = network_for(CONFIG, 16, 3)
    for change in ({"normalisation": "group"}, {"backbone": "conv"}):
        with pytest.raises(UsageError, match="see one vertex at a time"):
            compiled(network, replace(CONFIG, **change), CPU)
    monkeypatch.setenv("CXX", "no-such-compiler")
    with pytest.raises(UsageError, match=r"needs a C.. compiler, and there is no no-such-compiler"):
        compiled(network, CONFIG, CPU)
