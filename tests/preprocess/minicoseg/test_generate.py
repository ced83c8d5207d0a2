import numpy as np
import pytest

from meshshard.errors import UsageError
from meshshard.files import lock_folder
from meshshard.recipe import RECIPES
from meshshard_prep.datasets import read_dataset
from meshshard_prep.minicoseg import CLASSES, FAMILIES, Collection, generate, make_mesh
from meshshard_prep.run import run

SPLITS = ("train", "val", "test")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("set") / "minicoseg"
    assert generate(place, Collection(count=9)) == 9
    return place


def assert_same_but_for_the_name(folder, other):
    mine, others = files(folder), files(other)
    assert mine.pop("dataset.toml").decode() == others.pop("dataset.toml").decode().replace(other.name, folder.name)
    assert mine == others


def files(folder):
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file() and path.name != ".lock"
    }


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


def test_readme_says_the_settings_and_the_classes(folder):
    readme = (folder / "README.txt").read_text()
    assert "seed 0, 9 meshes, in turn chair, vase, alien; one in ten damaged on purpose" in readme
    assert all(f"{number} {name}\n" in readme for number, name in enumerate(CLASSES))


def test_a_second_run_changes_nothing_and_leaves_nothing(folder):
    before = files(folder)
    assert len(before) == 9 + 9 + 2
    assert generate(folder, Collection(count=9)) == 0
    assert files(folder) == before


def test_more_meshes_leave_the_earlier_ones_as_they_were(folder, tmp_path):
    generate(tmp_path, Collection(count=3))
    more, few = files(folder), files(tmp_path)
    del few["README.txt"], few["dataset.toml"]
    assert len(few) == 6
    assert few.items() <= more.items()


@pytest.mark.parametrize("other", [{"seed": 1, "count": 9}, {"count": 6}, {"count": 9, "faces": 500}])
def test_another_set_is_not_mixed_in(folder, other):
    before = files(folder)
    with pytest.raises(FileExistsError, match=r"holds other files \(seed 0, 9 meshes, .*empty folder"):
        generate(folder, Collection(**other))
    assert files(folder) == before


def test_meshes_that_nobody_speaks_for_are_not_mixed_in(tmp_path):
    (tmp_path / "val").mkdir()
    (tmp_path / "val" / "chair_000.obj").touch()
    with pytest.raises(FileExistsError, match=r"nobody knows which.*two sets would be mixed"):
        generate(tmp_path, Collection(count=3))


def test_files_of_others_are_left_alone(tmp_path):
    (tmp_path / "dataset.toml").write_text("precious = 1")
    with pytest.raises(FileExistsError, match=r"nobody knows which"):
        generate(tmp_path, Collection(count=3))
    assert (tmp_path / "dataset.toml").read_text() == "precious = 1"


def test_two_at_once_are_one(tmp_path):
    with lock_folder(tmp_path), pytest.raises(UsageError, match="another run is writing to"):
        generate(tmp_path, Collection(count=3))


def test_a_run_that_was_stopped_goes_on(tmp_path, folder):
    done = []

    def stop(*counts):
        done.append(counts)
        if len(done) == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        generate(tmp_path, Collection(count=9), progress=stop)
    assert done == [(1, 9, 0), (2, 9, 0)]
    assert not (tmp_path / "README.txt").exists()
    with pytest.raises(FileExistsError, match="two sets would be mixed"):
        generate(tmp_path, Collection(count=6))
    assert generate(tmp_path, Collection(count=9)) == 7
    assert_same_but_for_the_name(tmp_path, folder)


def test_two_processes_write_what_one_writes(tmp_path, folder):
    generate(tmp_path, Collection(count=9), jobs=2)
    assert_same_but_for_the_name(tmp_path, folder)


def test_a_test_bed_has_the_sizes_families_and_damage_that_were_asked_for(look, tmp_path):
    bed = Collection(count=12, families=("vase", "alien"), faces=300, defects=("open", "nonmanifold"), damaged=0.5)
    generate(tmp_path, bed)
    seen = {path.stem: look(*read(path)) for split in SPLITS for path in (tmp_path / split).glob("*.obj")}
    assert set(seen) == {f"{family}_{index:03d}" for family in ("vase", "alien") for index in range(6)}
    for family in ("vase", "alien"):
        uses = [sorted(set(seen[f"{family}_{index:03d}"].uses)) for index in range(6)]
        assert uses[0::2] == [[2]] * 3  # whole
        assert [uses[1], uses[5]] == [[1, 2]] * 2  # open
        assert 3 in uses[3]  # with a fin
    assert all(240 <= len(read(path)[1]) <= 360 for path in tmp_path.glob("t*/*.obj"))
    dataset = read_dataset(str(tmp_path / "dataset.toml"))
    assert dataset.classes == tuple(name for name in CLASSES if not name.startswith("chair"))
    report = run(dataset, tmp_path / "out", RECIPES["paper"], jobs=1)
    assert (len(report.index.ids), report.ok) == (12, True)


def read(path):
    rows = [line.split() for line in path.read_text().splitlines()]
    vertices = np.array([row[1:] for row in rows if row[0] == "v"], dtype=float)
    return vertices, np.array([row[1:] for row in rows if row[0] == "f"], dtype=int) - 1


@pytest.mark.parametrize("faces", [200, 6000])
@pytest.mark.parametrize("defect", ["", "open", "nonmanifold", "pieces"])
def test_any_size_has_about_the_faces_asked_for(faces, defect):
    for family in FAMILIES:
        assert 0.8 * faces <= len(make_mesh(family, 1, faces=faces, defect=defect).faces) <= 1.2 * faces


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"families": ("lamp",)}, "a family is one of chair, vase, alien, not lamp"),
        ({"count": 0}, "one mesh or more, not 0"),
        ({"faces": 10}, "200 to 100000 faces, not 10"),
        ({"damaged": 1.5}, "0 to 1, not 1.5"),
    ],
)
def test_what_cannot_be_made_is_told(settings, message):
    with pytest.raises(ValueError, match=message):
        Collection(**settings)
