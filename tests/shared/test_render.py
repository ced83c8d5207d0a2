import numpy as np
import pytest
from shapes import FAMILY, box, bumpy, rotation, sphere

from meshshard.palette import colours_of
from meshshard.render import AMBIENT, LIGHT, MARGIN, RAYS, View, png_bytes, render

FRONT = View(azimuth=0.0, elevation=0.0)
RED, GREEN, BLUE = np.eye(3, dtype="u1") * 255


def square(z, side=1.0):
    """Two faces across the z axis."""
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * side / 2
    return np.column_stack([corners, np.full(4, z)]), np.array([[0, 1, 2], [0, 2, 3]])


def plain(faces, colour=RED):
    return np.tile(colour, (len(faces), 1))


def hue(picture):
    """Which of red, green and blue each opaque pixel is; -1 elsewhere."""
    return np.where(picture[..., 3] == 255, picture[..., :3].argmax(axis=-1), -1)


def test_a_sphere_covers_its_disc():
    vertices, faces = sphere(5)
    picture = render(7 * vertices + 3, faces, plain(faces), size=200)
    assert (picture[..., 3] / 255).mean() == pytest.approx(np.pi / 4 / MARGIN**2, rel=2e-3)
    assert picture[0, 0].tolist() == [0, 0, 0, 0]


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_what_is_nearer_hides_what_is_behind(order):
    near, far = square(1.0, 1.0), square(-1.0, 2.0)
    pair = [(near, RED), (far, GREEN)]
    (first, one), (second, two) = pair[order[0]], pair[order[1]]
    vertices, faces = np.vstack([first[0], second[0]]), np.vstack([first[1], second[1] + 4])
    seen = hue(render(vertices, faces, np.vstack([plain([0, 0], one), plain([0, 0], two)]), size=104, view=FRONT))
    assert (seen[30:74, 30:74] == 0).all()  # the near one is half as wide as the far one
    assert (seen[4:20, 4:100] == 1).all()
    assert (seen[:, :1] == -1).all()


def test_y_is_up_x_is_right_and_the_camera_stands_on_the_z_axis():
    vertices, faces = box()
    sides = np.repeat(np.arange(6), 2)  # x=0, x=1, y=0, y=1, z=0, z=1

    def share(side, view, part=np.s_[:, :]):
        picture = render(
            vertices, faces, colours_of(np.where(sides == side, 0, 1), ("#FF0000", "#0000FF")), view=view
        )
        return (hue(picture[part]) == 0).mean()

    assert share(5, FRONT) == pytest.approx(1 / MARGIN**2, rel=0.02)
    assert share(1, View(azimuth=90.0, elevation=0.0)) == pytest.approx(1 / MARGIN**2, rel=0.02)
    assert share(3, View(azimuth=0.0, elevation=90.0)) == pytest.approx(1 / MARGIN**2, rel=0.02)
    assert all(share(side, View()) > 0.05 for side in (1, 3, 5))
    assert all(share(side, View()) == 0 for side in (0, 2, 4))
    assert share(3, View(), np.s_[:120]) > 3 * share(3, View(), np.s_[120:])  # the roof
    assert share(1, View(), np.s_[:, 120:]) > share(1, View(), np.s_[:, :120])


def test_axes_of_a_view_are_a_right_handed_frame():
    for azimuth in np.arange(0.0, 360.0, 45.0).tolist():
        for elevation in (-90.0, -30.0, 0.0, 60.0, 90.0):
            axes = View(azimuth=azimuth, elevation=elevation).axes
            np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-15)
            assert np.linalg.det(axes) == pytest.approx(1)


@pytest.mark.parametrize("seed", range(3))
def test_every_pixel_shows_what_a_ray_meets_first(seed):
    """Against all faces at once: those whose three edges a ray passes on one side, and the nearest of them."""
    vertices, faces = bumpy(seed, 1)
    vertices = vertices @ rotation(seed)
    colours = np.random.default_rng(seed).integers(0, 256, (len(faces), 3)).astype("u1")
    size = 24
    picture = render(vertices, faces, colours, size=size)
    points = (vertices @ View().axes.T)[faces]
    low, high = points.min(axis=(0, 1)), points.max(axis=(0, 1))
    points = (points - (low + high) / 2) / (MARGIN * (high - low)[:2].max() / 2)
    places = (np.arange(size * RAYS) + 0.5) * 2 / (size * RAYS) - 1
    rays = np.stack(np.meshgrid(places, -places), axis=-1).reshape(-1, 1, 2)
    a, b, c = (points[None, :, corner, :2] for corner in range(3))
    areas = np.stack([cross2(b - rays, c - rays), cross2(c - rays, a - rays), cross2(a - rays, b - rays)], axis=-1)
    inside = (areas >= 0).all(axis=-1) | (areas <= 0).all(axis=-1)
    depth = (areas / areas.sum(axis=-1, keepdims=True) * points[None, :, :, 2]).sum(axis=-1)
    depth = np.where(inside, depth, -np.inf)
    met, face = inside.any(axis=1), depth.argmax(axis=1)
    normals = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
    normals *= np.sign(normals[:, 2:]) / np.linalg.norm(normals, axis=1, keepdims=True)
    bright = AMBIENT + (1 - AMBIENT) * np.clip(normals @ LIGHT, 0, None)
    light = (
        np.where(met[:, None], colours[face] * bright[face, None], 0).reshape(size, RAYS, size, RAYS, 3).sum((1, 3))
    )
    count = met.reshape(size, RAYS, size, RAYS).sum((1, 3))
    expected = light / np.maximum(count, 1)[..., None]
    wrong = (np.abs(picture[..., :3] - expected) > 1).any(axis=-1) | (np.abs(picture[..., 3] - 255 * count / 9) > 1)
    assert wrong.sum() <= 2  # a ray within rounding of an edge


def cross2(a, b):
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def test_colours_of_corners_are_blended():
    corners = np.array([[0.0, 0, 0], [3, 0, 0], [0, 3, 0]])
    blended = np.stack([RED, GREEN, BLUE])[None]
    picture = render(corners, np.array([[0, 1, 2]]), blended, size=156, view=FRONT)
    flat = render(corners, np.array([[0, 1, 2]]), np.full((1, 3), 255, dtype="u1"), size=156, view=FRONT)
    x, y = np.meshgrid((np.arange(156) + 0.5) / 52, (np.arange(156) + 0.5) / 52)
    inside = picture[..., 3] == 255
    reach = 1.5 * MARGIN
    x, y = x * reach / 1.5 - (reach - 1.5), (3 - y) * reach / 1.5 - (reach - 1.5)
    expected = np.stack([1 - (x + y) / 3, x / 3, y / 3], axis=-1) * flat[..., :3]
    assert np.abs(picture[..., :3] - expected)[inside].max() <= 2
    assert inside.sum() > 10000


@pytest.mark.parametrize("name", FAMILY)
def test_windings_and_unused_vertices_do_not_matter(name):
    vertices, faces = FAMILY[name]
    colours = colours_of(np.arange(len(faces)))
    picture = render(vertices, faces, colours, size=60)
    assert (picture[..., 3] > 0).any()
    more = np.vstack([vertices, [[1e6, 0, 0]]])
    np.testing.assert_array_equal(picture, render(more, faces, colours, size=60))
    turned = render(vertices, faces[:, [0, 2, 1]], colours, size=60)
    assert (np.abs(picture.astype(int) - turned) > 1).any(axis=-1).mean() < 0.01  # ties on edges


def test_a_needle_along_the_view_is_nothing_to_see():
    needle = np.array([[0.0, 0, 0], [0, 0, 1], [0, 0, 2]])
    assert not render(needle, np.array([[0, 1, 2]]), plain([0]), size=8, view=FRONT).any()


def test_png_reads_back():
    from io import BytesIO

    from PIL import Image

    vertices, faces = sphere(1)
    picture = render(vertices, faces, plain(faces), size=50)
    np.testing.assert_array_equal(np.asarray(Image.open(BytesIO(png_bytes(picture)))), picture)
