import numpy as np
import pytest

from meshshard_prep.minicoseg import CLASSES, FAMILIES, make_mesh, split_and_defect

SOUND = [(family, index) for family in FAMILIES for index in range(3)]
DAMAGED = {
    (family, split_and_defect(0, family, index)[1]): index
    for family in FAMILIES
    for index in range(30)
    if split_and_defect(0, family, index)[1]
}
NEVER_MISSING = {
    "chair": {"chair seat", "chair legs"},
    "vase": {"vase base", "vase body", "vase neck"},
    "alien": {"alien head", "alien body", "alien limbs"},
}


@pytest.fixture(scope="module")
def meshes():
    keys = [*SOUND, *((family, index) for (family, _), index in DAMAGED.items())]
    return {key: make_mesh(*key) for key in keys}


@pytest.mark.parametrize(("family", "index"), SOUND)
def test_a_sound_mesh_is_one_closed_surface_seen_from_outside(look, meshes, family, index):
    mesh = meshes[family, index]
    seen = look(np.round(mesh.vertices, 6), mesh.faces)
    assert mesh.defect == ""
    assert seen.closed
    assert seen.components == 1
    assert seen.volume > 0.01
    assert seen.smallest_area > 1e-6


def test_size_labels_and_name_of_every_mesh(meshes):
    for (family, index), mesh in meshes.items():
        assert mesh.name == f"{family}_{index:03d}"
        assert 500 <= len(mesh.faces) <= 1500
        assert mesh.labels.shape == (len(mesh.faces),)
        names = {CLASSES[label] for label in mesh.labels}
        assert NEVER_MISSING[family] <= names <= {name for name in CLASSES if name.startswith(family)}
        assert np.unique(mesh.faces).tolist() == list(range(len(mesh.vertices)))
        assert 0.4 < np.ptp(mesh.vertices, axis=0).max() < 1.6


def test_labels_lie_where_the_parts_are(meshes):
    for (family, _), mesh in meshes.items():
        height = mesh.vertices[mesh.faces].mean(axis=1)[:, 1]
        middle = {CLASSES[label]: height[mesh.labels == label].mean() for label in np.unique(mesh.labels)}
        order = {
            "chair": ["chair legs", "chair seat", "chair back"],
            "vase": ["vase base", "vase body", "vase neck"],
            "alien": ["alien limbs", "alien body", "alien head"],
        }[family]
        heights = [middle[name] for name in order if name in middle]
        assert heights == sorted(heights)


@pytest.mark.parametrize("family", FAMILIES)
def test_an_open_mesh_has_a_border_and_no_other_fault(look, meshes, family):
    mesh = meshes[family, DAMAGED[family, "open"]]
    seen = look(mesh.vertices, mesh.faces)
    assert mesh.defect == "open"
    assert set(seen.uses) == {1, 2}
    assert seen.oriented
    assert (seen.pinched, seen.components) == (0, 1)


@pytest.mark.parametrize("family", FAMILIES)
def test_a_nonmanifold_mesh_has_edges_of_three_faces(look, meshes, family):
    mesh = meshes[family, DAMAGED[family, "nonmanifold"]]
    assert mesh.defect == "nonmanifold"
    assert np.count_nonzero(look(mesh.vertices, mesh.faces).uses == 3) >= 4


@pytest.mark.parametrize("family", FAMILIES)
def test_pieces_are_closed_one_by_one(look, meshes, family):
    mesh = meshes[family, DAMAGED[family, "pieces"]]
    seen = look(mesh.vertices, mesh.faces)
    assert mesh.defect == "pieces"
    assert seen.closed
    assert seen.components >= 2
    assert seen.volume > 0.01


def test_the_same_seed_gives_the_same_bytes_and_another_does_not(meshes):
    again, other = make_mesh("vase", 1), make_mesh("vase", 1, seed=5)
    first = meshes["vase", 1]
    for field in ("vertices", "faces", "labels"):
        assert getattr(again, field).tobytes() == getattr(first, field).tobytes()
    assert other.vertices.tobytes() != first.vertices.tobytes()


def test_unknown_family():
    with pytest.raises(ValueError, match="family 'lamp' is none of chair, vase, alien"):
        make_mesh("lamp", 0)
