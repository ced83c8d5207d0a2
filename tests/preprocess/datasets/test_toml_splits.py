"""Splits of a TOML file: lists, fractions, folds, groups."""

from collections import Counter

import pytest
from shapes import tetrahedron, write_labels, write_obj

from meshshard.errors import UsageError
from meshshard_prep.datasets import Draw, read_dataset


@pytest.fixture
def raw(tmp_path):
    """Six subjects of five poses, three of each of two classes."""
    for subject in range(6):
        for pose in range(5):
            write_obj(tmp_path / "raw" / f"class{subject % 2}" / f"s{subject}_pose{pose}.obj", *tetrahedron())
    return tmp_path / "raw"


def split(raw, text, **draw):
    file = raw.parent / "my.toml"
    file.write_text(f'raw = "raw"\n{text}')
    return read_dataset(str(file), draw=Draw(**draw))


def test_lists_in_the_file_are_ids_paths_names_and_patterns(raw):
    found = split(
        raw, '[splits]\ntrain = ["class0/s0_*", "s1_pose0"]\ntest = ["class1/s1_pose1.obj", "**/s5_pose?"]\n'
    )
    assert found.split_rule == "by lists"
    assert Counter(found.splits.values()) == {"train": 6, "test": 6, "": 18}
    assert found.splits["class1/s1_pose0"] == "train"
    (note,) = found.notes
    assert note.endswith("my.toml:3: 18 meshes are in no list, and so in no split; the first is class0/s2_pose0")


def test_more_folds_than_meshes_are_refused(raw):
    with pytest.raises(UsageError, match=r"my.toml:3: splits.folds is at most the number of meshes, 30, not 31"):
        split(raw, "[splits]\nfolds = 31\n")


def test_without_a_list_of_train_the_rest_is_train(raw):
    found = split(raw, '[splits]\ntest = ["**/s5_*"]\nval = ["**/s4_*"]\n')
    assert Counter(found.splits.values()) == {"train": 20, "val": 5, "test": 5}
    assert found.notes == ()


def test_list_files_lie_below_raw(raw):
    (raw / "lists").mkdir()
    (raw / "lists" / "test.txt").write_text("# held out\ns0_pose0\n\nclass0/s2_pose1.obj\nmissing\n")
    found = split(raw, '[splits]\ntest = "lists/test.txt"\n')
    assert sorted(name for name, part in found.splits.items() if part == "test") == [
        "class0/s0_pose0",
        "class0/s2_pose1",
    ]
    assert found.notes == ("test.txt:5: 1 names of splits.test are no meshes, the first is 'missing'",)


def test_fractions_are_drawn_by_seed_and_class_by_class(raw):
    text = '[labels]\nmesh = "folder"\n[splits]\nfractions = { train = 0.6, val = 0.2, test = 0.2 }\n'
    found = split(raw, text)
    assert found.split_rule == "drawn by seed, class by class: 0.2 test, 0.2 val, 0.6 train"
    label = {entry.id: entry.mesh_label for entry in found.entries}
    assert Counter((part, label[name]) for name, part in found.splits.items()) == {
        **{("train", 0): 9, ("train", 1): 9},
        **{("val", 0): 3, ("val", 1): 3, ("test", 0): 3, ("test", 1): 3},
    }
    assert split(raw, text).splits == found.splits != split(raw, text, seed=1).splits


def test_folders_with_classes_of_their_own_are_split_in_the_same_shares(raw):
    for mesh in raw.rglob("*.obj"):
        write_labels(mesh.with_suffix(".seg"), [1, 1, 2, 2])
    text = "[classes.class0]\na = 1\nb = 2\n[classes.class1]\nc = 1\nd = 2\n[splits]\nfolds = 5\n"
    found = split(raw, text)
    assert found.split_rule.endswith("class by class")
    assert Counter(name[:6] for name, part in found.splits.items() if part == "test") == {"class0": 3, "class1": 3}
    assert split(raw, "[splits]\nfolds = 5\n").split_rule == "fold 0 of 5 is test, drawn by seed"


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("way", ["fractions = { train = 0.5, test = 0.5 }", "folds = 3"])
def test_groups_stay_together(raw, way, seed):
    found = split(raw, f"[splits]\n{way}\ngroup = '(s\\d)_pose'\n", seed=seed)
    assert "whole groups" in found.split_rule
    parts = {}
    for entry in found.entries:
        parts.setdefault(entry.group, set()).add(found.splits[entry.id])
    assert sorted(parts) == [f"s{number}" for number in range(6)]
    assert all(len(part) == 1 for part in parts.values())


def test_of_few_meshes_each_split_gets_one(raw):
    found = split(raw, "meshes = '*/s0*'\n[splits]\nfractions = { train = 0.7, val = 0.15, test = 0.15 }\n")
    assert Counter(found.splits.values()) == {"train": 3, "val": 1, "test": 1}


def test_groups_are_handed_to_what_a_run_draws_later(raw):
    groups = {entry.id: entry.group for entry in split(raw, "[splits]\ngroup = '(s[01])_'\n").entries}
    assert {groups[name] for name in groups if "/s1_" in name} == {"s1"}
    assert groups["class0/s2_pose0"] == "class0/s2_pose0"


def test_every_mesh_is_tested_in_one_fold(raw):
    text = '[labels]\nmesh = "folder"\n[splits]\nfolds = 5\n'
    tested = Counter()
    for fold in range(5):
        found = split(raw, text, fold=fold)
        assert found.split_rule == f"fold {fold} of 5 is test, drawn by seed, class by class"
        held = [entry for entry in found.entries if found.splits[entry.id] == "test"]
        assert Counter(entry.mesh_label for entry in held) == {0: 3, 1: 3}
        tested.update(entry.id for entry in held)
    assert set(tested.values()) == {1}
    assert len(tested) == 30


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "fractions = { train = 0.5, tset = 0.5 }",
            "my.toml:3: splits.fractions are of train, val, test, not 'tset'; do",
        ),
        ("fractions = { train = 0.5, test = 0.6 }", "my.toml:3: splits.fractions sum to 1, not 1.1"),
        ("folds = 1", "my.toml:3: splits.folds is a whole number, 2 or more, not 1"),
        ("folds = 3\nfractions = { train = 1 }", "my.toml:3: splits.folds says .*, and so does splits.fractions"),
        ("test = ['s0_pose0']\nfolds = 3", "my.toml:4: splits.folds says .*, and so does splits.test"),
        ("group = 'pose'", "my.toml:3: splits.group has one pair of parentheses"),
        ("group = '(pose'", "my.toml:3: splits.group is a regular expression.*missing"),
        ("group = '(x)_'", "my.toml:3: splits.group matches no mesh: .* is not in 'class0/s0_pose0'"),
        ("test = [\n 's0_pose0',\n 'class0/s0_posse1']", None),
        ("test = ['class0/s0_posse1']", "splits.test names no mesh: .*my.toml:3.*do you mean 'class0/s0_pose1'"),
        ("test = 'test.txt'", "my.toml:3: the list .*test.txt cannot be read: No such file"),
        (
            "test = ['s0_pose0']\nval = ['*/s0_*']",
            "splits.test has 'class0/s0_pose0' .*my.toml:3.*, which is in val too",
        ),
    ],
)
def test_mistakes_are_told_with_the_line(raw, text, message):
    if message is None:
        assert "my.toml:5: 1 names of splits.test are no meshes" in split(raw, f"[splits]\n{text}\n").notes[0]
        return
    with pytest.raises(UsageError, match=message):
        split(raw, f"[splits]\n{text}\n")


def test_a_fold_needs_folds(raw):
    with pytest.raises(UsageError, match=r"my.toml:2: splits.folds is 3: --fold is 0 to 2, not 3"):
        split(raw, "splits.folds = 3\n", fold=3)
    with pytest.raises(UsageError, match=r"splits.folds is not there, so there is no fold 1; leave out --fold"):
        split(raw, "", fold=1)


def test_folders_with_classes_of_their_own_keep_their_shares(tmp_path):
    for name in ("a", "b"):  # the highest class of both is the same
        for number in range(10):
            write_obj(tmp_path / "raw" / name / f"{number}.obj", *tetrahedron())
            write_labels(tmp_path / "raw" / name / f"{number}.txt", [1, 2, 1, 2])
    text = "[classes.a]\nx = 1\nz = 2\n[classes.b]\ny = 1\nz = 2\n[splits]\nfractions = { train = 0.7, test = 0.3 }\n"
    for seed in range(5):
        found = split(tmp_path / "raw", "[labels]\ndomain = 'face'\n" + text, seed=seed)
        assert Counter((name[0], part) for name, part in found.splits.items()) == {
            ("a", "train"): 7,
            ("a", "test"): 3,
            ("b", "train"): 7,
            ("b", "test"): 3,
        }
