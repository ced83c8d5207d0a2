"""A run from its start to its results, in this process."""

from training import CPU

from meshshard import open_dataset
from meshshard_train.loop import train
from meshshard_train.results import write_results


def finished_run(data, run, config):
    """Train, evaluate and write; the content of results.json."""
    dataset = open_dataset(data)
    return write_results(dataset, run, train(dataset, config, run, CPU), CPU)[0]
