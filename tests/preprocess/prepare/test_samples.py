import numpy as np
from shapes import bumpy

from meshshard_prep.prepare.samples import POINTS, SIDE, sample_points


def test_points_are_the_centres_of_equal_parts():
    (weights,) = sample_points(np.eye(3)[None])
    assert weights.shape == (POINTS, 3)
    np.testing.assert_allclose(weights.sum(axis=1), 1)
    # a part is known by which strip it is in along each of the three sides; a centre is a third of a strip inside
    strips, inside = np.divmod(weights * SIDE, 1)
    assert len({tuple(row) for row in strips.tolist()}) == POINTS
    np.testing.assert_allclose(np.abs(inside - 0.5), 1 / 6)


def test_the_first_is_the_centre_and_the_mean_of_all_is_it_too():
    vertices, faces = bumpy(1)
    points = sample_points(vertices[faces])
    np.testing.assert_allclose(points[:, 0], vertices[faces].mean(axis=1))
    np.testing.assert_allclose(points.mean(axis=1), vertices[faces].mean(axis=1))
