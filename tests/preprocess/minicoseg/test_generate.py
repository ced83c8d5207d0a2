import numpy as np
import pytest

from meshshard_prep.minicoseg import CLASSES, FAMILIES, generate, make_mesh

SPLITS = ("train", "val", "test")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("set") / "minicoseg"
    assert generate(place, per_family=3) == 9
    return place


def files(folder):
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_every_mesh_is_in_one_split_and_has_its_labels(folder):
    names = {f"{family}_{index:03d}" for family in FAMILIES for index in range(3)}
    splits = {split: {path.stem for path in (folder / split).iterdir()} for split in SPLITS}
    assert sum(map(len, splits.values())) == len(set().union(*splits.values())) == 9
    assert set().union(*splits.values()) == names == {path.stem for path in (folder / "seg").iterdir()}
    assert {len(split) for split in splits.values()} == {3}


def test_files_hold_the_meshes_to_six_decimals(folder):
    for path in (path for split in SPLITS for path in (folder / split).glob("*.obj")):
        text = path.read_text()
        assert text.endswith("\n")
        rows = [line.split() for line in text.splitlines()]
        vertices = np.array([row[1:] for row in rows if row[0] == "v"], dtype=float)
        faces = np.array([row[1:] for row in rows if row[0] == "f"], dtype=int) - 1
        labels = np.loadtxt(folder / "seg" / f"{path.stem}.seg", dtype=int)
        family, index = path.stem.split("_")
        mesh = make_mesh(family, int(index))
        assert len(rows) == len(vertices) + len(faces)
        np.testing.assert_allclose(vertices, mesh.vertices, atol=5.1e-7)
        np.testing.assert_array_equal(faces, mesh.faces)
        np.testing.assert_array_equal(labels, mesh.labels)


def test_readme_says_the_seed_and_the_classes(folder):
    readme = (folder / "README.txt").read_text()
    assert "seed 0, 3 meshes of each family" in readme
    assert all(f"{number} {name}\n" in readme for number, name in enumerate(CLASSES))


def test_a_second_run_changes_nothing_and_leaves_nothing(folder):
    before = files(folder)
    assert len(before) == 9 + 9 + 1
    generate(folder, per_family=3)
    assert files(folder) == before


def test_more_meshes_leave_the_earlier_ones_as_they_were(folder, tmp_path):
    generate(tmp_path, per_family=1)
    more, few = files(folder), files(tmp_path)
    del few["README.txt"]
    assert len(few) == 6
    assert few.items() <= more.items()


@pytest.mark.parametrize("other", [{"seed": 1, "per_family": 3}, {"per_family": 2}, {"per_family": 4}])
def test_another_set_is_not_mixed_in(folder, other):
    before = files(folder)
    with pytest.raises(FileExistsError, match=r"holds other meshes than seed . with . per family.*empty folder"):
        generate(folder, **other)
    assert files(folder) == before


def test_meshes_left_by_an_unfinished_run_of_another_seed_are_seen(tmp_path):
    (tmp_path / "val").mkdir()
    (tmp_path / "val" / "chair_999.obj").touch()
    with pytest.raises(FileExistsError, match="two sets would be mixed"):
        generate(tmp_path, per_family=1)
