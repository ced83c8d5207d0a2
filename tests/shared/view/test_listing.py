"""Which meshes are listed."""

import pytest
from samples import sample, write_dataset

from meshshard import open_dataset
from meshshard.view.listing import LARGEST, STORED, WORST, Listing


@pytest.fixture(scope="module")
def listing(tmp_path_factory):
    samples = [sample(n, level=n % 2, id=f"{kind}{n}") for n, kind in enumerate(["Chair", "chair", "vase", "vase"])]
    splits = ["test", "train", "test", ""]
    return Listing(open_dataset(write_dataset(tmp_path_factory.mktemp("shards"), samples, splits)))


@pytest.mark.parametrize(
    ("text", "found"),
    [("", [0, 1, 2, 3]), ("CHAIR", [0, 1]), ("  test  chair ", [0]), ("no split", [3]), ("alien", [])],
)
def test_every_word_is_in_the_id_or_the_split_in_any_case(listing, text, found):
    assert listing.find(text, STORED, {}) == found


def test_orders(listing):
    assert listing.find("", LARGEST, {}) == [1, 3, 0, 2]
    assert listing.find("", WORST, {0: 0.9, 2: 0.1}) == [2, 0, 1, 3]
