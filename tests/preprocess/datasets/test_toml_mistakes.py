"""Every mistake in a TOML file is told with its line, what was found and what may be there."""

import pytest
from shapes import box, write_labels, write_obj

from meshshard.errors import UsageError
from meshshard_prep.datasets import read_dataset


@pytest.fixture
def raw(tmp_path):
    write_obj(tmp_path / "cat" / "train" / "a.obj", *box())
    write_labels(tmp_path / "cat" / "train" / "a.seg", [1, 2] * 6)
    (tmp_path / "classes.txt").write_text("dog\n")
    (tmp_path / "twice.txt").write_text("a cat\na dog\n")
    return tmp_path


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("\nnmae = 'x'", "2: unknown key 'nmae'; do you mean 'name'\\?; known are name, raw"),
        ("files = 'x'", "1: unknown key 'files'; do you mean 'labels.files'"),
        ("label_domain = 'face'", "1: unknown key 'label_domain'; do you mean 'labels.domain'"),
        ("[labels]\n\n# files = 1\nfile = 'x'", "4: unknown key 'labels.file'; do you mean 'labels.files'"),
        ("labels = 'x'", "1: labels is a table: write \\[labels\\], and its keys below"),
        ("name = 3", "1: name is a text in quotes, not 3"),
        ("name = '../x'", "1: name is letters, digits.*not '../x'"),
        ("name = ''", "1: name is letters"),
        ("name = ", "1: this is no TOML: invalid value"),
        ("name = 'a'\nname = 'b'", "2: this is no TOML: cannot overwrite a value"),
        ("name = 'a", "1: this is no TOML: "),
        ("layout = 'foldre'", "1: layout is one of folder, .*, not 'foldre'; do you mean 'folder'"),
        ("raw = 'nowhere'", "1: raw is a folder that is there, and .*nowhere is not"),
        (
            "meshes = [\n'**',\n'*.ply']",
            "3: meshes has the pattern '\\*.ply', and no mesh.*there is 'cat/train/a.obj'",
        ),
        ("meshes = 3", "1: meshes is a text in quotes or a list of them, not 3"),
        ("[labels]\ndomain = 'vertx'", "2: labels.domain is one of .*, not 'vertx'; do you mean 'vertex'"),
        ("[labels]\nform = 'line'", "2: labels.form is one of lines, .*, not 'line'; do you mean 'lines'"),
        ("[labels]\nform = 'ply'", '2: labels.form is "ply": say with labels.name which property'),
        ("[labels]\nto = 'edge'", "2: labels.to is one of face, vertex, not 'edge'"),
        (
            "[labels]\nfiles = 'gt/{stem}.seg'",
            "2: labels.files finds no file: .* asks for .*gt/a.seg as the labels of cat",
        ),
        ("[labels]\nfiles = 'a.seg'", "2: labels.files names one file for all meshes.*write {stem}"),
        (
            "[labels]\nfiles = '{stm}.seg'",
            "2: labels.files may have {stem}, .*{below}, not {stm}; do you mean 'stem'",
        ),
        ("[labels]\nfiles = '{stem.seg'", "2: labels.files names one file for all meshes: '{stem.seg'; write {stem}"),
        ("[labels]\nfiles = '{stem:>3000000000}'", "2: labels.files may have {stem}, .*not {stem:>3000000000}"),
        ("[classes]\na = -1", "2: classes has the label -1 for 'a', and -1 always means unlabelled"),
        ("meshes = '[z-a].obj'", "1: '\\[z-a\\].obj' is no pattern"),
        ("[splits]\ngroup = '(a){4294967296}'", "2: splits.group is a regular expression"),
        (
            "[labels]\nfiles = '{stem}.seg'\nmesh = 'folder'",
            "2: labels.files does not go with labels.mesh = 'folder'",
        ),
        ("[labels]\nfiles = 'all.json'", r"2: labels.files names one .*; write {stem} in it, or in labels.name if"),
        (
            "[labels]\nfiles = 'all.json'\nname = '{stm}'",
            "3: labels.name may have {stem}, .*, not {stm}; do you mean 'stem'",
        ),
        ("[labels]\nfiles = 'all.json'\nname = '{stem}'", "2: labels.files finds no file: 'all.json'"),
        ("classes = ['a']", "1: classes has 1 names, and the label files have 2 labels: 1, 2"),
        ("classes = ['a', 'b',\n'a']", "2: classes names 'a' twice"),
        ("classes = ['a', 'a']\n[labels]\nmesh = 'folder'", "1: classes names 'a' twice"),
        (
            "[labels]\nmesh = 'folder'\n[classes]\na = 'cat'\nb = ['dog', 'cat']",
            "5: classes has the label 'cat' for 'b', and the class 'a' has it too",
        ),
        (
            "[labels]\nmesh = 'folder'\n[classes.cat]\na = 1",
            "3: classes has a table for 'cat', which labels.mesh leaves no room for",
        ),
        ("classes = [1, 2]", "1: classes is a list of names, or a table"),
        ("[classes]\na = 1\nb = [2, 1]", "3: classes has the label 1 for 'b', and the class 'a' has it too"),
        ("[classes]\na = 1\n[labels]\nunlabelled = 1", "2: classes has the label 1 for 'a', and labels.unlabelled"),
        ("[colours]\n1 = '#123456'\n3 = '#123456'", "3: colours names '3', which is no class"),
        ("[classes]\nleg = [1, 2]\n[colours]\nlge = '#000000'", "4: colours names 'lge', .*; do you mean 'leg'"),
        ("[colours]\n1 = 'red'", "2: colours are written as '#1a2b3c', not 'red'"),
        ("[labels]\nmesh = 'class.txt'", "2: the list .*class.txt cannot be read: No such file"),
        (
            "[labels]\nmesh = 'classes.txt'",
            "2: labels.mesh is a list of meshes and classes.*; classes.txt:1 is 'dog'",
        ),
        (
            "[labels]\nmesh = 'twice.txt'",
            "2: labels.mesh gives 'cat/train/a' two classes: 'cat', and 'dog' in twice.txt:2",
        ),
        ("classes = ['x', 'y']\n[labels]\nmesh = 'folder'", "1: classes has 2 names, and the classes are cat"),
        ("[labels]\nmesh = 'folder'\n[classes]\nx = 'cats'", "3: classes has no class 'cat', .*do you mean 'cats'"),
        ("[labels]\nmesh = 'folder'\n[classes]\nx = 'y'", "3: classes has no class 'cat', .*take the table away"),
        ("raw = 'cat/train'\n[labels]\nmesh = 'folder'", '3: labels.mesh is "folder", and a.obj is in no folder'),
        (
            "layout = 'meshcnn-classification'\n[labels]\nform = 'lines'",
            "3: labels.form does not go with layout = 'mesh",
        ),
        ("layout = 'meshcnn-segmentation'\nmeshes = '*'", "2: meshes does not go with layout"),
    ],
)
def test_mistakes(raw, text, message):
    (raw / "my.toml").write_text(text)
    with pytest.raises(UsageError, match=f"my.toml:?{message}"):
        read_dataset(str(raw / "my.toml"))


def test_keys_of_labels_need_labels(raw):
    (raw / "cat" / "train" / "a.seg").unlink()
    (raw / "my.toml").write_text("[labels]\ndomain = 'face'\n")
    with pytest.raises(UsageError, match=r"my.toml:2: labels.domain is about label files, and no mesh has one"):
        read_dataset(str(raw / "my.toml"))


def test_what_is_no_text_is_told(raw):
    (raw / "my.toml").write_bytes(b"name = '\xff'")
    with pytest.raises(UsageError, match=r"my.toml cannot be read: 'utf-8' codec"):
        read_dataset(str(raw / "my.toml"))


def test_lists_in_lists_without_end(tmp_path):
    (tmp_path / "my.toml").write_text(f"classes = {'[' * 5000}")
    with pytest.raises(UsageError, match=r"my.toml cannot be read: maximum recursion"):
        read_dataset(str(tmp_path / "my.toml"))
