import numpy as np
import pytest

from meshshard_train.metrics import Confusion


def test_by_hand():
    found = Confusion(3)
    found.add(np.array([0, 0, 1, 1, -1]), np.array([0, 1, 1, 1, 2]), np.array([1.0, 3.0, 1.0, 1.0, 9.0]))
    assert found.accuracy() == 0.75
    assert found.area_accuracy() == 0.5
    assert found.class_iou()[:2] == [1 / 2, 2 / 3]
    assert np.isnan(found.class_iou()[2])  # neither there nor predicted
    assert found.summary()["mean_iou"] == pytest.approx((1 / 2 + 2 / 3) / 2)


def test_one_batch_of_sixty_is_batches_of_seven():
    rng = np.random.default_rng(0)
    truth, predicted, areas = rng.integers(-1, 4, 60), rng.integers(0, 4, 60), rng.random(60)
    whole, parts = Confusion(4), Confusion(4)
    whole.add(truth, predicted, areas)
    for start in range(0, 60, 7):
        parts.add(truth[start : start + 7], predicted[start : start + 7], areas[start : start + 7])
    for name in ("accuracy", "area_accuracy", "mean_iou"):
        assert parts.summary()[name] == pytest.approx(whole.summary()[name], rel=1e-12)
    assert whole.accuracy() == (truth == predicted)[truth >= 0].mean()


def test_mesh_accuracy_is_the_mean_over_meshes():
    found = Confusion(2)
    found.add(np.zeros(10, dtype=int), np.zeros(10, dtype=int))
    found.add(np.zeros(2, dtype=int), np.array([0, 1]))
    assert found.summary()["mesh_accuracy"] == 0.75
    assert found.accuracy() == pytest.approx(11 / 12)


def test_nothing_counted_is_not_a_number():
    assert all(np.isnan(value) for value in Confusion(3).summary().values())
