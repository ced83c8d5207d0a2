"""Samples through torch's loader: every way of starting workers gives each once, as reading here does."""

from operator import itemgetter

import numpy as np
import pytest
from effort import SOAKING
from samples import toy_dataset
from torch.utils.data import DataLoader

from meshshard import open_dataset

METHODS = [(None, 0), ("fork", 1), ("fork", 2), ("spawn", 2), ("forkserver", 1)]
if SOAKING:  # each of these imports torch, which takes seconds
    METHODS += [("spawn", 1), ("forkserver", 2)]


@pytest.mark.soak
@pytest.mark.filterwarnings("ignore:.*multi-threaded, use of fork:DeprecationWarning")
@pytest.mark.parametrize(("method", "workers"), METHODS)
def test_each_sample_once_an_epoch(tmp_path, measured, method, workers):
    dataset = open_dataset(toy_dataset(tmp_path))
    here = [dataset[number] for number in range(len(dataset))]  # mapped before the workers start
    loader = DataLoader(
        dataset,
        batch_size=1,
        shuffle=True,
        num_workers=workers,
        multiprocessing_context=method,
        collate_fn=itemgetter(0),
        persistent_workers=workers > 0,
    )
    for _ in range(2):
        found = {sample.id: sample for sample in loader}
        assert sorted(found) == list(dataset.ids)
        assert all(found[sample.id].digest == sample.digest for sample in here)
        np.testing.assert_array_equal(found[here[3].id].hks, here[3].hks)
    measured("R8", f"each sample once an epoch, {method or 'no'} workers, {workers} of them")
