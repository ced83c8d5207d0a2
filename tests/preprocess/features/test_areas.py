import numpy as np
import pytest
from shapes import FAMILY, box, rotation

from meshshard_prep.features.areas import face_areas, vertex_areas


@pytest.mark.parametrize(("a", "b", "c"), [(1, 1, 1), (1, 2, 3), (0.1, 10, 5)])
def test_surface_of_a_box(a, b, c):
    vertices, faces = box(a, b, c)
    assert face_areas(vertices, faces).sum() == pytest.approx(2 * (a * b + b * c + c * a), rel=1e-14)


@pytest.mark.parametrize("name", FAMILY)
def test_vertex_areas_share_the_surface_out(name):
    vertices, faces = FAMILY[name]
    areas = vertex_areas(vertices, faces)
    assert areas.sum() == pytest.approx(face_areas(vertices, faces).sum(), rel=1e-13)
    assert (areas > 0).all()
    np.testing.assert_allclose(vertex_areas(5 * vertices @ rotation().T, faces), 25 * areas, rtol=1e-12)


def test_unreferenced_vertices_have_no_area():
    vertices, faces = box()
    assert vertex_areas(np.vstack([vertices, [[7, 7, 7]]]), faces)[-1] == 0
