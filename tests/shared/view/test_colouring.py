"""Colours and legends of meshes."""

import numpy as np
import pytest
from samples import PAPER, sample

from meshshard.palette import class_colour, colours_between, colours_of
from meshshard.view.colouring import DIHEDRAL, ERRORS, HKS, LABEL, NORMALS, PREDICTION, Classes, choices, coloured
from meshshard.view.opinion import Opinion, labelled_element, true_labels
from meshshard.view.words import end_of, of_corner

CLASSES = Classes(("low", "middle", "high & <dry>"), ())
MESH = sample(3, level=2)


def test_choices_need_labels_and_a_network():
    assert choices(labelled=False, judged=False) == [HKS, DIHEDRAL, NORMALS]
    assert choices(labelled=True, judged=False)[0] == LABEL
    assert choices(labelled=False, judged=True)[0] == PREDICTION
    assert ERRORS in choices(labelled=True, judged=True)
    assert ERRORS not in choices(labelled=False, judged=True)


def test_labels_have_the_palettes_colours_and_a_legend_with_shares():
    drawn = coloured(LABEL, MESH, 0, "faces", CLASSES, None)
    assert drawn.of_faces
    np.testing.assert_array_equal(drawn.colours, colours_of(MESH.face_labels))
    share = 100 * (MESH.face_labels == 2).mean()
    assert class_colour(2) in drawn.legend
    assert f"high &amp; &lt;dry&gt;</span><span>{share:.1f} %" in drawn.legend


def test_errors_are_where_labels_and_predictions_differ_and_none_where_nothing_is_known():
    truth = MESH.face_labels.copy()
    truth[:5] = -1
    said = np.where(np.arange(len(truth)) < 20, (MESH.face_labels + 1) % 3, MESH.face_labels)
    drawn = coloured(ERRORS, sample(3, level=2, face_labels=truth), 0, "faces", CLASSES, Opinion(said, 0.9))
    kinds, counts = np.unique(drawn.colours, axis=0, return_counts=True)
    assert sorted(counts.tolist()) == [5, 15, len(truth) - 20]
    assert [name in drawn.legend for name in ("unlabelled", "right", "wrong")] == [True] * 3
    assert len(kinds) == 3


def test_labels_of_vertices_and_of_whole_meshes():
    names = {"face_labels": None, "vertex_labels": np.zeros(len(MESH.vertices), dtype="i2")}
    drawn = coloured(LABEL, sample(3, level=2, **names), 0, "vertices", CLASSES, None)
    assert (drawn.of_faces, len(drawn.colours)) == (False, len(MESH.vertices))
    whole = sample(3, level=2, face_labels=None, mesh_label=1)
    assert labelled_element(whole) == "mesh"
    assert true_labels(whole, "mesh").tolist() == [1]
    drawn = coloured(LABEL, whole, 0, "mesh", CLASSES, None)
    assert (drawn.colours == colours_of(np.array([1]))).all()
    assert drawn.corners(MESH.faces).shape == MESH.faces.shape


@pytest.mark.parametrize("what", [HKS, DIHEDRAL, NORMALS])
def test_features_colour_vertices(what):
    drawn = coloured(what, MESH, 3, "faces", CLASSES, None)
    assert (drawn.of_faces, drawn.colours.shape) == (False, MESH.vertices.shape)
    assert drawn.corners(MESH.faces).shape == (*MESH.faces.shape, 3)


def test_the_highest_hks_is_yellow_and_the_legend_has_the_time_with_its_unit():
    drawn = coloured(HKS, MESH, 3, "faces", CLASSES, None)
    assert drawn.colours[MESH.hks[:, 3].argmax()].tolist() == [0xFD, 0xE7, 0x25]
    assert f"t = {PAPER.times[3]:.3g} squared radii" in drawn.legend


def test_hks_is_coloured_by_its_logarithm_and_vertices_of_no_face_do_not_count():
    size = len(MESH.vertices) + 1
    heat = np.geomspace(1, 100, size, dtype="f4")[:, None].repeat(len(PAPER.times), axis=1)
    heat[-1] = 0
    values = {name: np.pad(getattr(MESH, name), (0, 1)) for name in ("dihedral", "vertex_areas")}
    values |= {name: np.pad(getattr(MESH, name), ((0, 1), (0, 0))) for name in ("vertices", "vertex_normals")}
    drawn = coloured(HKS, sample(3, level=2, hks=heat, **values), 0, "faces", CLASSES, None)
    middle = colours_between(np.array([0.5]), 0.0, 1.0)[0].astype(int)
    assert abs(drawn.colours[size // 2].astype(int) - middle).max() < 6
    assert drawn.colours[-1].tolist() == [0x44, 0x01, 0x54]
    assert "<span>1.0" in drawn.legend


def test_what_is_said_of_a_corner():
    words = of_corner(MESH, 7, 2, "faces", CLASSES, Opinion(np.full(len(MESH.faces), 2), 0.5))
    angle = np.rad2deg(MESH.dihedral[2])
    assert f"vertex 2: mean dihedral angle {angle:.1f}°" in words
    assert f"face 7: label {CLASSES.names[MESH.face_labels[7]]}".split(" &")[0] in words
    assert "face 7: prediction high &amp; &lt;dry&gt;" in words
    assert "label" not in of_corner(MESH, 7, 2, "faces", Classes((), ()), None)


def test_of_a_long_name_the_end_is_kept():
    assert end_of("train/scape_01", 14) == "train/scape_01"
    assert end_of("train/scape_01", 9) == "…scape_01"
