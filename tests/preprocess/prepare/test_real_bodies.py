"""Labels of real bodies after simplifying: area against area."""

import numpy as np
import pytest

from meshshard.recipe import Recipe
from meshshard_prep.datasets import read_dataset
from meshshard_prep.jobs import read_entry
from meshshard_prep.pipeline import compute_sample

PLAIN, FEWER = Recipe(name="plain"), Recipe(name="fewer", simplify=750)


def class_areas(sample, classes):
    """Share of each class of the surface."""
    shares = np.bincount(sample.face_labels + 1, sample.face_areas * sample.scale**2, classes + 1)
    return shares / shares.sum()


@pytest.mark.data
def test_classes_of_human_seg_keep_their_share_of_the_surface(data_root):
    dataset = read_dataset("human_seg", data_root / "human_seg")
    changed = []
    for entry in dataset.entries[::60]:
        before, after = (compute_sample(entry, *read_entry(entry), recipe) for recipe in (PLAIN, FEWER))
        assert (len(after.faces), after.diagnostics["faces_before"]) == (750, 1500)
        assert 0.1 < after.diagnostics["ambiguous_faces"] / 750 < 0.25
        assert after.label_rule.startswith(before.label_rule + "; then carried to the simplified mesh")
        shares = [class_areas(sample, len(dataset.classes)) for sample in (before, after)]
        changed.append(np.abs(shares[0] - shares[1]).sum() / 2)
    assert np.mean(changed) < 0.012
    assert max(changed) < 0.025
