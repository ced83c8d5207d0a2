import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from meshshard_prep.minicoseg.implicit import box, disc, ellipsoid, revolved, round_cone, smooth_union, tube

POINTS = np.random.default_rng(3).uniform(-1.2, 1.2, size=(4000, 3))
CENTRE = np.array([0.1, -0.2, 0.3])
TURN = Rotation.from_euler("xyz", [0.4, -1.1, 2.0]).as_matrix()
BENT = np.array([[-0.5, -0.4, 0.1], [0.3, -0.2, 0.2], [0.4, 0.6, -0.3]])
CUP = np.array([[0.2, -0.5], [0.5, -0.1], [0.3, 0.4], [0.6, 0.6]])

EXACT = {
    "ball": lambda p: ellipsoid(p, CENTRE, np.full(3, 0.5)),
    "box": lambda p: box(p, CENTRE, np.array([0.5, 0.3, 0.4]), 0.05),
    "turned box": lambda p: box(p, CENTRE, np.array([0.5, 0.3, 0.4]), 0.05, TURN),
    "disc": lambda p: disc(p, CENTRE, 0.6, 0.2, 0.05),
    "round cone": lambda p: round_cone(p, BENT[0], BENT[1], 0.3, 0.1),
    "tube": lambda p: tube(p, BENT, np.array([0.1, 0.2, 0.15])),
    "revolved": lambda p: revolved(p, CUP, 0.04),
}


def slope(distance, points):
    step = 1e-6 * np.eye(3)
    return np.stack([distance(points + s) - distance(points - s) for s in step], axis=1) / 2e-6


@pytest.mark.parametrize("name", EXACT)
def test_gradient_of_a_distance_has_length_one(name):
    length = np.linalg.norm(slope(EXACT[name], POINTS), axis=1)
    assert length.max() < 1 + 1e-6
    assert np.mean(length > 1 - 1e-6) > 0.995  # the rest straddles a medial axis


@pytest.mark.parametrize("name", EXACT)
def test_one_step_along_the_gradient_is_on_the_surface(name):
    outside = POINTS[EXACT[name](POINTS) > 0]
    landed = outside - EXACT[name](outside)[:, None] * slope(EXACT[name], outside)
    assert np.mean(np.abs(EXACT[name](landed)) < 1e-6) > 0.99


def test_ball_and_its_centre():
    expected = np.linalg.norm(POINTS - CENTRE, axis=1) - 0.5
    np.testing.assert_allclose(ellipsoid(POINTS, CENTRE, np.full(3, 0.5)), expected, atol=1e-12)
    assert ellipsoid(CENTRE[None], CENTRE, np.array([0.5, 0.2, 0.3])) == -0.2


def test_ellipsoid_is_of_first_order_at_its_surface():
    radii = np.array([0.7, 0.3, 0.5])
    normal = POINTS / np.linalg.norm(POINTS, axis=1, keepdims=True)
    surface = CENTRE + (normal * radii) @ TURN.T
    value = lambda p: ellipsoid(p, CENTRE, radii, TURN)  # noqa: E731
    np.testing.assert_allclose(value(surface), 0, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(slope(value, surface), axis=1), 1, atol=1e-6)
    inside = (((POINTS - CENTRE) @ TURN / radii) ** 2).sum(axis=1) < 1
    np.testing.assert_array_equal(value(POINTS) < 0, inside)


def test_capsule_is_the_distance_to_its_axis():
    axis = BENT[1] - BENT[0]
    share = np.clip((POINTS - BENT[0]) @ axis / (axis @ axis), 0, 1)
    expected = np.linalg.norm(POINTS - BENT[0] - share[:, None] * axis, axis=1) - 0.2
    np.testing.assert_allclose(round_cone(POINTS, BENT[0], BENT[1], 0.2, 0.2), expected, atol=1e-12)


@pytest.mark.parametrize("radii", [(0.3, 0.1), (0.1, 0.3)])
def test_round_cone_is_the_union_of_the_balls_along_it(radii):
    share = np.linspace(0, 1, 2001)[:, None, None]
    centres = BENT[0] + share * (BENT[1] - BENT[0])
    sizes = (radii[0] + share * (radii[1] - radii[0]))[:, :, 0]
    few = POINTS[:300]
    balls = (np.linalg.norm(few - centres, axis=2) - sizes).min(axis=0)
    outside = balls > 0
    ours = round_cone(few, BENT[0], BENT[1], *radii)
    np.testing.assert_allclose(ours[outside], balls[outside], atol=1e-6)
    assert (ours[~outside] <= 1e-6).all()


def test_box_off_a_side_an_edge_and_a_corner():
    half = np.array([0.5, 0.3, 0.4])
    points = np.array([[0.8, 0.1, 0.1], [0.8, 0.7, 0.0], [0.8, 0.7, 0.8], [0.0, 0.2, 0.0]])
    expected = [0.3, 0.5, np.sqrt(0.3**2 + 0.4**2 + 0.4**2), -0.1]
    np.testing.assert_allclose(box(points + CENTRE, CENTRE, half, 0.0), expected, atol=1e-12)


def test_turned_box_is_the_box_of_turned_points():
    half = np.array([0.5, 0.3, 0.4])
    np.testing.assert_allclose(
        box(POINTS @ TURN.T, np.zeros(3), half, 0.1, TURN), box(POINTS, np.zeros(3), half, 0.1), atol=1e-12
    )


def test_revolved_rectangle_is_a_disc():
    rectangle = np.array([[0.55, -0.25], [0.55, 0.25]])
    np.testing.assert_allclose(
        revolved(POINTS, rectangle, 0.05), disc(POINTS, np.zeros(3), 0.6, 0.3, 0.05), atol=1e-12
    )


def test_revolved_half_circle_is_a_ball():
    angle = np.linspace(-np.pi / 2, np.pi / 2, 400)
    circle = 0.5 * np.column_stack([np.cos(angle), np.sin(angle)])
    np.testing.assert_allclose(revolved(POINTS, circle, 0.1), np.linalg.norm(POINTS, axis=1) - 0.6, atol=1e-4)


def test_smooth_union_differs_from_the_least_only_within_the_blend():
    one, two = np.random.default_rng(5).normal(size=(2, 1000))
    both = smooth_union((one, two), 0.4)
    near = np.abs(one - two) < 0.4
    np.testing.assert_array_equal(both[~near], np.minimum(one, two)[~near])
    assert (both[near] < np.minimum(one, two)[near]).all()
    np.testing.assert_allclose(smooth_union((one, one), 0.4), one - 0.1, atol=1e-12)
