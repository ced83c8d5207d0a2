"""Which meshes are meant, and where the results of each go."""

from pathlib import Path

import pytest

from meshshard import UsageError
from meshshard_train.prediction_inputs import meshes_of, source_names

OUT = Path("out")


@pytest.fixture
def files(tmp_path, monkeypatch):
    """Makes empty files, by their paths below the folder that is worked in."""
    monkeypatch.chdir(tmp_path)

    def make(*names):
        for name in names:
            Path(name).parent.mkdir(parents=True, exist_ok=True)
            Path(name).touch()

    return make


def named(*given):
    return {name: str(path) for name, path in meshes_of([Path(path) for path in given], OUT).items()}


def test_files_by_their_names_and_folders_by_the_paths_in_them(files):
    files("a.obj", "x/b.OFF", "set/one.ply", "set/deep/er/two.obj", "set/deep/two.seg", "set/.hidden/c.obj")
    assert named("a.obj", "x/b.OFF", "set") == {
        "a": "a.obj",
        "b": "x/b.OFF",
        "one": "set/one.ply",
        "deep/er/two": "set/deep/er/two.obj",
    }


@pytest.mark.parametrize(
    ("given", "names"),
    [
        (["x/m.obj", "y/m.obj"], ["x/m", "y/m"]),
        (["x/m.obj", "y/m.obj", "z/n.off"], ["x/m", "y/m", "z/n"]),
        (["x", "y/m.obj"], ["x/m", "x/sub/m", "y/m"]),
        (["x/sub/m.obj", "x/m.obj"], ["sub/m", "m"]),
        (["x", "x/sub"], ["m", "sub/m"]),  # once
        (["x/m.obj", "x/../x/m.obj"], ["m"]),
        (["z/n.off", "z/n.ply"], ["n.off", "n.ply"]),
        (["z", "y"], ["n.off", "n.ply", "n.off.obj", "m.obj"]),
    ],
)
def test_no_two_meshes_have_one_name(files, given, names):
    files("x/m.obj", "x/sub/m.obj", "y/m.obj", "z/n.off", "z/n.ply", "z/n.off.obj")
    found = named(*given)
    assert sorted(found) == sorted(names)
    assert len({Path(path).resolve() for path in found.values()}) == len(found)


def test_results_are_no_meshes_to_label(files):
    files("a.obj", "out/a.ply", "out/deep/b.ply", "set/out/c.txt")
    assert named(".") == {"a": "a.obj"}
    with pytest.raises(UsageError, match=r"set holds no mesh: no file outside out ends in \.obj, \.off, \.ply"):
        named("set")
    assert meshes_of([Path("out/deep")], Path()) == {"b": Path("out/deep/b.ply")}


@pytest.mark.parametrize("given", ["out/a.ply", "link/a.ply", "out"])
def test_results_beside_a_mesh_are_refused(files, given):
    files("out/a.ply")
    Path("link").symlink_to("out")
    with pytest.raises(UsageError, match=f"--out out: results would be written beside the mesh {given}"):
        named(given)


def test_what_is_not_there_is_refused(files):
    files("a.obj")
    with pytest.raises(UsageError, match=r"b\.obj: no such mesh file or folder"):
        named("a.obj", "b.obj")


def test_files_are_numbered_and_looked_at_whatever_their_ending():
    meshes = {"a": Path("a.OFF"), "b": Path("b.stl"), "c": Path("c.ply")}
    assert source_names(meshes) == {"00000000.OFF": "a", "00000001.obj": "b", "00000002.ply": "c"}
