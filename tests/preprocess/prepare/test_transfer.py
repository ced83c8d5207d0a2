from collections import Counter

import numpy as np
import pytest
from prepared import start
from shapes import FAMILY, bumpy, grid, sphere

from meshshard_prep.labels import Labels
from meshshard_prep.prepare.largest_component import largest_component
from meshshard_prep.prepare.samples import sample_points
from meshshard_prep.prepare.simplify import simplify
from meshshard_prep.prepare.transfer import carried, majority_of_points

RULE = "carried to the simplified mesh by the majority of area"


def of_faces(labels, rule=""):
    return Labels(domain="face", rule=rule, faces=np.asarray(labels).astype(np.int16))


@pytest.mark.parametrize("seed", range(5))
def test_majority_against_counting(seed):
    labels = np.random.default_rng(seed).integers(-1, 3, (200, 25)).astype(np.int16)
    found, several = majority_of_points(labels)
    for row, label in zip(labels.tolist(), found.tolist(), strict=True):
        count = Counter(row)
        best = [value for value in count if count[value] == max(count.values())]
        assert label == min(best, key=lambda value: (value == -1, value))
    assert several == sum(len(set(row)) > 1 for row in labels.tolist())


@pytest.mark.parametrize(
    ("row", "label"), [([2, 1, 1, 2], 1), ([-1, 5, 5, -1], 5), ([-1, -1, 3], -1), ([32767, -1], 32767)]
)
def test_of_equal_labels_the_lowest_and_unlabelled_last(row, label):
    assert majority_of_points(np.array([row], dtype=np.int16))[0] == [label]


def test_on_a_flat_sheet_the_label_is_that_of_the_larger_part():
    """Simplifying a flat sheet does not move it: which points lie where is known without looking for the nearest."""
    vertices, faces = grid(20, 20)
    mesh, _ = simplify(start(vertices, faces), 60)
    labels, counts = carried(of_faces(vertices[faces].mean(axis=1)[:, 0] > 7), mesh)
    left = (sample_points(mesh.vertices[mesh.faces])[:, :, 0] > 7).mean(axis=1)
    np.testing.assert_array_equal(labels.faces, left > 0.5)
    assert counts == {"ambiguous_faces": ((left > 0) & (left < 1)).sum()}
    assert counts["ambiguous_faces"] > 5
    assert labels.rule == RULE


@pytest.mark.parametrize("axis", range(3))
def test_halves_of_a_sphere_keep_their_share_of_the_area(axis):
    vertices, faces = sphere(4)
    mesh, _ = simplify(start(vertices, faces), 300)
    labels, counts = carried(of_faces(vertices[faces].mean(axis=1)[:, axis] > 0), mesh)
    corners = mesh.vertices[mesh.faces]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    assert areas @ labels.faces / areas.sum() == pytest.approx(0.5, abs=0.02)
    height = corners[:, :, axis]
    assert labels.faces[(height > 0.05).all(axis=1)].all()
    assert not labels.faces[(height < -0.05).all(axis=1)].any()
    assert counts["ambiguous_faces"] <= ((height > -0.05).any(axis=1) & (height < 0.05).any(axis=1)).sum()


def test_labels_of_vertices_come_from_the_nearest():
    vertices, faces = bumpy(3, 3)
    mesh, _ = simplify(start(vertices, faces), 100)
    given = Labels(domain="vertex", rule="as written", vertices=np.arange(len(vertices), dtype=np.int16))
    labels, counts = carried(given, mesh)
    distance = np.linalg.norm(mesh.vertices[:, None] - vertices, axis=2)
    np.testing.assert_array_equal(labels.vertices, distance.argmin(axis=1))
    assert labels.rule == "as written; then carried to the simplified mesh by the nearest vertex"
    assert counts == {}


def test_steps_that_move_nothing_take_labels_along_unchanged():
    vertices, faces = FAMILY["pieces"]
    mesh, _ = largest_component(start(vertices, faces))
    labels, counts = carried(of_faces(np.arange(len(faces)), "by a rule"), mesh)
    np.testing.assert_array_equal(labels.faces, mesh.triangle_sources[:, 0])
    assert (labels.rule, counts) == ("by a rule", {"ambiguous_faces": 0})
