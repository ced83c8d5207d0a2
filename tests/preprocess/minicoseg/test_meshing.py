import numpy as np
import pytest

from meshshard_prep.minicoseg.meshing import COARSEST, FINISHES, marching, triangulate
from meshshard_prep.minicoseg.parts import bar, egg
from meshshard_prep.minicoseg.shape import THIN, Shape

BALL = Shape((egg(0, [0.1, 0.5, 0.0], 0.25),), blend=0.01)


@pytest.mark.parametrize("finish", FINISHES)
def test_a_ball_in_every_finish(look, finish):
    vertices, faces = triangulate(BALL, 900, np.random.default_rng(0), (finish,))
    seen = look(vertices, faces)
    assert seen.closed
    assert (seen.components, seen.euler) == (1, 2)
    assert seen.volume == pytest.approx(4 / 3 * np.pi * 0.25**3, rel=0.02)
    assert len(faces) == pytest.approx(900, rel=0.05)
    np.testing.assert_allclose(np.linalg.norm(vertices - [0.1, 0.5, 0], axis=1), 0.25, atol=1e-4)


def test_finishes_differ_in_how_even_their_triangles_are():
    spread = {}
    for finish in FINISHES:
        vertices, faces = triangulate(BALL, 900, np.random.default_rng(0), (finish,))
        edges = np.linalg.norm(vertices[faces] - vertices[np.roll(faces, 1, axis=1)], axis=2)
        spread[finish] = edges.std() / edges.mean()
    assert spread["uniform"] < spread["relaxed"] < spread["grid"]


def test_a_thin_bar_survives_the_coarsest_grid(look):
    rng = np.random.default_rng(2)
    for _ in range(20):
        direction = rng.normal(size=3)
        start = np.array([0, 0.6, 0])
        end = start + 0.5 * direction / np.linalg.norm(direction)
        seen = look(*marching(Shape((bar(0, start, end, THIN),), blend=0.01), COARSEST, rng))
        assert seen.closed
        assert (seen.components, seen.euler) == (1, 2)


def test_marching_cubes_skip_nothing_between_blocks():
    shape = Shape((bar(0, [-0.6, 0.1, -0.5], [0.6, 1.2, 0.5], 0.05, 0.3),), blend=0.01)
    vertices, _ = marching(shape, 0.04, np.random.default_rng(0))
    assert np.abs(shape.value(vertices)).max() < 0.01


def test_a_large_shape_is_collapsed_even_if_a_grid_was_asked_for():
    large = Shape((egg(0, [0, 0.8, 0], 0.7),), blend=0.01)
    _, faces = triangulate(large, 1000, np.random.default_rng(0), ("grid",))
    assert len(faces) == pytest.approx(1000, abs=2)
