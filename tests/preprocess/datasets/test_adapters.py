"""Each layout is built to the letter here; what is at hand is read whole in test_real_data.py."""

from pathlib import Path

import pytest
from shapes import box, sphere, write_labels, write_obj, write_off, write_ply

from meshshard.errors import UsageError
from meshshard.index import TASKS
from meshshard.recipe import RECIPES
from meshshard_prep.datasets import ADAPTERS, Draw, read_dataset
from meshshard_prep.datasets.coseg import PARTS
from meshshard_prep.datasets.human_seg import group_of
from meshshard_prep.run import run


def segmentation_folder(root, meshes, labels):
    """`meshes`: split/name -> mesh; every mesh gets the same label lines."""
    for name, mesh in meshes.items():
        write_obj(root / f"{name}.obj", *mesh)
        write_labels(root / "seg" / f"{name.split('/')[1]}.eseg", labels)
    return root


def test_every_known_data_set_says_what_it_is():
    for name, adapter in ADAPTERS.items():
        assert adapter.name == name
        assert adapter.summary
        assert adapter.licence
        assert adapter.citation
        assert adapter.origin
        assert adapter.task in TASKS


def test_human_seg(tmp_path):
    root = segmentation_folder(tmp_path, {"train/scape__mesh000": box(), "test/shrec__1": box()}, range(1, 9))
    dataset = read_dataset("human_seg", root)
    assert dataset.classes == ("head", "hand", "lower arm", "upper arm", "body", "upper leg", "lower leg", "foot")
    assert [(e.id, e.split, e.group, e.source) for e in dataset.entries] == [
        ("train/scape__mesh000", "train", "SCAPE", "train/scape__mesh000.obj"),
        ("test/shrec__1", "test", "shrec__1", "test/shrec__1.obj"),
    ]
    assert dataset.entries[0].labels.classes == {value: value - 1 for value in range(1, 9)}
    assert dataset.entries[0].labels.domains == ("edge",)
    assert dataset.entries[0].labels.path == root / "seg" / "scape__mesh000.eseg"


def test_human_groups():
    assert group_of("MIT_animation__meshes_march1__meshes__mesh_0010") == "MIT march1"
    assert group_of("faust__tr_reg_042") == "FAUST 4"
    assert group_of("scape__mesh003") == "SCAPE"
    assert group_of("adobe__FemaleFitA_tri_fixed") == "adobe__FemaleFitA_tri_fixed"


@pytest.mark.parametrize("first", [0, 1], ids=["the paper's archive, faces from 0", "MeshCNN's, edges from 1"])
def test_coseg_set(tmp_path, first):
    # a box has 12 faces and 18 edges; the labels need not hold every part
    values = [first + part for part in range(3)] * (4 if first == 0 else 6)
    segmentation_folder(tmp_path / "coseg_vases", {"train/1": box(), "test/2": box()}, values)
    for root in (tmp_path, tmp_path / "coseg_vases"):
        dataset = read_dataset("coseg_vases", root)
        assert dataset.classes == tuple(f"vases part {part}" for part in range(4))
        assert dataset.entries[0].labels.classes == {first + part: part for part in range(4)}
        assert dataset.entries[0].labels.domains == (("face",) if first == 0 else ("edge",))


@pytest.mark.parametrize(("first", "domain", "count"), [(0, "face", 12), (1, "edge", 18)])
@pytest.mark.parametrize("write", [write_ply, write_off])
def test_coseg_meshes_may_be_of_any_format(tmp_path, write, first, domain, count):
    root = tmp_path / "coseg_chairs"
    write((root / "train" / "1").with_suffix(f".{write.__name__[-3:]}"), *box())
    write_labels(root / "seg" / "1.eseg", [first + number % 3 for number in range(count)])
    (labels,) = [entry.labels for entry in read_dataset("coseg_chairs", tmp_path).entries]
    assert (labels.domains, labels.classes) == ((domain,), {first + part: part for part in range(3)})


def test_coseg_is_all_three_sets(tmp_path):
    for shape, parts in PARTS.items():
        segmentation_folder(tmp_path / f"coseg_{shape}", {"train/1": box(), "test/2": box()}, [0, parts - 1] * 6)
    dataset = read_dataset("coseg", tmp_path)
    assert len(dataset.classes) == 11
    assert [e.id for e in dataset.entries] == [f"{s}/{i}" for s in PARTS for i in ("train/1", "test/2")]
    assert dataset.entries[-1].labels.classes == {0: 7, 1: 8, 2: 9, 3: 10}
    assert dataset.entries[-1].source == "coseg_vases/test/2.obj"
    wrong = "coseg_aliens has 169 train meshes, and 1 were found"
    assert read_dataset("coseg_aliens", tmp_path).notes == (wrong,)


def test_coseg_tells_which_set_is_missing(tmp_path):
    segmentation_folder(tmp_path / "coseg_chairs", {"train/1": box()}, range(3))
    with pytest.raises(UsageError, match="lacks coseg_aliens, coseg_vases"):
        read_dataset("coseg", tmp_path)


def test_classification_layout(tmp_path):
    for name in ("cat/train/T2", "cat/test/T1", "ant/train/T3"):
        write_obj(tmp_path / f"{name}.obj", *sphere(0))
    (tmp_path / "SOURCE.txt").write_text("not a class")
    dataset = read_dataset("cubes", tmp_path)
    assert dataset.classes == ("ant", "cat")
    assert [(e.id, e.split, e.mesh_label) for e in dataset.entries] == [
        ("ant/train/T3", "train", 0),
        ("cat/train/T2", "train", 1),
        ("cat/test/T1", "test", 1),
    ]


@pytest.mark.parametrize("name", ["cubes", "."])
def test_a_fold_where_there_are_none_is_refused(tmp_path, monkeypatch, name):
    write_obj(tmp_path / "data/raw/cubes/cat/train/1.obj", *box())
    monkeypatch.chdir(tmp_path)
    with pytest.raises(UsageError, match="has no folds, so there is no fold 2; leave out --fold"):
        read_dataset(name, draw=Draw(fold=2))


def test_plain_folder(tmp_path):
    write_obj(tmp_path / "b.obj", *box())
    write_obj(tmp_path / "deep" / "a.OBJ", *box())
    dataset = read_dataset(str(tmp_path))
    assert (dataset.task, dataset.classes, dataset.name) == ("unlabelled", (), tmp_path.name)
    assert [(e.id, e.split, e.labels) for e in dataset.entries] == [("b", "", None), ("deep/a", "", None)]


def test_folder_with_labels_and_splits(tmp_path):
    for split in ("train", "test"):
        write_obj(tmp_path / split / "a.obj", *box())
    write_labels(tmp_path / "train" / "a.seg", [5, 2] * 6)
    dataset = read_dataset(str(tmp_path))
    assert (dataset.task, dataset.classes) == ("segmentation", ("2", "5"))
    train, test = sorted(dataset.entries, key=lambda e: e.split, reverse=True)
    assert (train.split, train.labels.classes) == ("train", {2: 0, 5: 1})
    assert train.labels.path == tmp_path / "train" / "a.seg"
    assert test.labels.path == tmp_path / "test" / "a.seg"  # not there: that mesh will be refused


def test_folders_named_like_splits_are_splits_wherever_they_are(tmp_path):
    for folder in ("train", "chair/Validation", "chair/testing/deep", "trains", "testing.obj"):
        write_obj(tmp_path / folder / "a.obj", *box())
    assert {e.id: e.split for e in read_dataset(str(tmp_path)).entries} == {
        "train/a": "train",
        "chair/Validation/a": "val",
        "chair/testing/deep/a": "test",
        "trains/a": "",
        "testing.obj/a": "",
    }


def test_one_mesh_file(tmp_path):
    write_obj(tmp_path / "a.obj", *box())
    dataset = read_dataset(str(tmp_path / "a.obj"))
    assert [(e.id, e.source) for e in dataset.entries] == [("a", "a.obj")]


def test_same_stem_keeps_its_suffix(tmp_path):
    write_obj(tmp_path / "a.obj", *box())
    (tmp_path / "a.off").write_text("OFF\n")
    assert {e.id for e in read_dataset(str(tmp_path)).entries} == {"a.obj", "a.off"}


def test_two_label_files_are_refused(tmp_path):
    write_obj(tmp_path / "a.obj", *box())
    write_labels(tmp_path / "a.seg", [1])
    write_labels(tmp_path / "a.txt", [1])
    with pytest.raises(UsageError, match=r"two label files: a.seg and a.txt"):
        read_dataset(str(tmp_path))


def test_what_is_not_there_says_what_to_do(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(UsageError, match=r"make features DATASET=human_seg RAW=<folder>"):
        read_dataset("human_seg")
    with pytest.raises(UsageError, match=r"'cseg' is no known data set.*known are minicoseg, human_seg"):
        read_dataset("cseg")
    (tmp_path / "empty").mkdir()
    with pytest.raises(UsageError, match="holds no mesh"):
        read_dataset("empty")
    with pytest.raises(UsageError, match="--raw goes with"):
        read_dataset("empty", tmp_path)
    for name in ("human_seg", "shrec_16"):
        with pytest.raises(UsageError, match="layout"):
            read_dataset(name, tmp_path / "empty")


def test_what_a_folder_passes_over_and_what_it_does_not(tmp_path):
    write_obj(tmp_path / "raw" / "a.OBJ", *box())
    write_obj(tmp_path / "raw" / "folder.obj" / "inside.Ply", *box())
    write_obj(tmp_path / "raw" / "._a.obj", *box())
    write_obj(tmp_path / "raw" / ".git" / "b.obj", *box())
    write_obj(tmp_path / "elsewhere" / "c.obj", *box())
    (tmp_path / "raw" / "linked").symlink_to(tmp_path / "elsewhere")
    (tmp_path / "raw" / "linked.obj").symlink_to(tmp_path / "elsewhere" / "c.obj")
    (tmp_path / "raw" / "gone.obj").symlink_to(tmp_path / "nowhere.obj")
    (tmp_path / "raw" / "loop.obj").symlink_to(tmp_path / "raw" / "loop.obj")
    (tmp_path / "raw" / "up").symlink_to(tmp_path / "raw")
    dataset = read_dataset(str(tmp_path / "raw"))
    assert [e.source for e in dataset.entries] == [
        "a.OBJ",
        "folder.obj/inside.Ply",
        "gone.obj",
        "linked.obj",
        "loop.obj",
    ]
    report = run(dataset, tmp_path / "out", RECIPES["paper"], jobs=1)
    assert report.index.ids == ("a", "folder.obj/inside", "linked")
    assert [(entry.source, entry.code) for entry in report.index.refused] == [
        ("gone.obj", "unreadable"),
        ("loop.obj", "unreadable"),
    ]


def test_a_folder_that_cannot_be_listed_is_an_error(tmp_path, monkeypatch):
    write_obj(tmp_path / "a.obj", *box())
    (tmp_path / "closed").mkdir()
    iterdir = Path.iterdir

    def refuse(path):
        if path.name == "closed":
            raise PermissionError(13, "Permission denied", str(path))
        return iterdir(path)

    monkeypatch.setattr(Path, "iterdir", refuse)
    with pytest.raises(PermissionError, match="closed"):
        read_dataset(str(tmp_path))


def test_a_hidden_folder_that_is_named_is_read(tmp_path):
    write_obj(tmp_path / ".cache" / "a.obj", *box())
    assert [e.source for e in read_dataset(str(tmp_path / ".cache")).entries] == ["a.obj"]
