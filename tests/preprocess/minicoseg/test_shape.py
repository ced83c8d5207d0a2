import numpy as np

from meshshard_prep.minicoseg.parts import bar, egg
from meshshard_prep.minicoseg.shape import Shape

POINTS = np.random.default_rng(1).uniform(-1, 1, size=(2000, 3))
FAR_APART = Shape(
    (egg(0, [-0.5, 0, 0], 0.3), egg(4, [0.5, 0, 0], 0.3), bar(2, [0, -1, 0], [0, 1, 0], 0.1)), blend=0.01
)


def test_tangent_of_a_ball_is_its_distance_and_radius():
    value, slope = Shape((egg(0, [0, 0, 0], 0.5),), blend=0.1).tangent(POINTS)
    radius = np.linalg.norm(POINTS, axis=1, keepdims=True)
    np.testing.assert_allclose(value, radius[:, 0] - 0.5, atol=1e-8)
    np.testing.assert_allclose(slope, POINTS / radius, atol=1e-3)


def test_every_point_has_the_class_of_the_nearest_part():
    points = np.array([[-0.9, 0, 0], [0.9, 0, 0], [0.05, 0.3, 0], [-0.5, 0, 0]])
    assert FAR_APART.labels(points).tolist() == [0, 4, 2, 0]


def test_the_highest_class_comes_off():
    loose, rest = FAR_APART.apart()
    assert [part.label for part in loose.parts] == [4]
    assert [part.label for part in rest.parts] == [0, 2]
    np.testing.assert_allclose(
        np.minimum(loose.value(POINTS), rest.value(POINTS)), FAR_APART.value(POINTS), atol=0.01 / 4
    )
