"""URLs as paths."""

import pickle
import subprocess
import sys
from pathlib import Path

import fsspec
import pytest
from samples import toy_dataset

from meshshard.errors import UsageError
from meshshard.remote import RemotePath, listed, local_folder, to_path

FILES = {"a.obj": b"v 0 0 0\n", "train/b.OBJ": b"", "train/deep/c d.obj": b"x", "text.toml": "name = 'é'\n".encode()}


@pytest.fixture
def root():
    """memory://here with FILES in it."""
    memory = fsspec.filesystem("memory")
    memory.pipe({f"/here/{name}": content for name, content in FILES.items()})
    yield to_path("memory://here")
    memory.rm("/here", recursive=True)


@pytest.fixture
def twin(tmp_path):
    """The same files in a folder."""
    folder = tmp_path / "here"
    for name, content in FILES.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    return folder


def test_a_remote_path_answers_as_a_folder_does(root, twin):
    for name in (".", "a.obj", "train", "train/deep/c d.obj", "nothing", "a.obj/nothing"):
        there, here = root / name, twin / name
        assert (there.exists(), there.is_file(), there.is_dir()) == (here.exists(), here.is_file(), here.is_dir())
        if here.is_file():
            assert (there.read_bytes(), there.stat().st_size) == (here.read_bytes(), here.stat().st_size)
        assert there.relative_to(root) == here.relative_to(twin)
        assert there.with_suffix(".seg").name == here.with_suffix(".seg").name
    assert (root / "text.toml").read_text(encoding="utf-8") == (twin / "text.toml").read_text(encoding="utf-8")
    for name in (".", "train", "train/deep"):
        assert {path.name for path in (root / name).iterdir()} == {path.name for path in (twin / name).iterdir()}
    assert [path.name for path in root.glob("*.obj")] == ["a.obj"]
    assert list((root / "nothing").glob("*")) == []


def test_what_a_url_means():
    assert to_path("meshes/a") == Path("meshes/a")
    assert to_path(Path("file:///a")) == Path("file:/a")  # who has a path means a path
    assert (str(to_path("s3://bucket/a/../b")), to_path("s3://bucket").name) == ("s3://bucket/a/../b", "bucket")
    assert str(to_path("s3://bucket/a/").parent / "b.obj") == "s3://bucket/b.obj"
    assert to_path("s3://bucket/a").resolve() == to_path("s3://bucket/a")


def test_file_urls_are_plain_paths(tmp_path):
    name = tmp_path / "50% of [all] #1 ?"
    assert to_path(name.as_uri()) == name
    assert not isinstance(to_path(name.as_uri()), RemotePath)


@pytest.mark.parametrize(
    ("url", "message"),
    [
        ("file://meshes/a", "a file URL has three slashes"),
        ("s3://", "names no host or bucket"),
        ("s3:///a", "names no host or bucket"),
        ("nosuch://a/b", "nosuch"),
    ],
)
def test_urls_that_mean_nothing(url, message):
    with pytest.raises(UsageError, match=message):
        to_path(url)


def test_nothing_is_written_behind_a_url(root):
    with pytest.raises(UsageError, match="a folder of this machine"):
        local_folder("s3://bucket/out")
    for ask in (root.mkdir, (root / "new").touch, (root / "a.obj").unlink, root.rmdir):
        with pytest.raises(TypeError, match="is not on this machine"):
            ask()


def test_a_path_cannot_leave_its_url(root):
    """As the name of a shard in somebody's index could try to."""
    with pytest.raises(FileNotFoundError, match="left its URL"):
        (root / "/etc/passwd").read_bytes()


@pytest.mark.parametrize(
    ("error", "kind", "words"),
    [
        (FileNotFoundError("no such key"), FileNotFoundError, r"No such file or directory \(no such key\)"),
        (PermissionError("Forbidden"), PermissionError, "PermissionError: Forbidden"),
        (ConnectionResetError(104, "Connection reset by peer"), OSError, "Connection reset by peer"),
        (RuntimeError("the token has expired"), OSError, "RuntimeError: the token has expired"),
    ],
)
def test_every_failure_is_an_os_error_with_its_cause(root, monkeypatch, error, kind, words):
    def fail(*_, **__):
        raise error

    for method in ("info", "find", "ls", "cat_file"):
        monkeypatch.setattr(fsspec.filesystem("memory"), method, fail)
    for ask in (root.read_bytes, root.stat, lambda: list(root.iterdir())):
        with pytest.raises(kind, match=words) as caught:
            ask()
        assert caught.value.strerror
        assert caught.value.filename == "memory://here"
    with pytest.raises(UsageError, match=words):
        listed(root)


def test_a_file_in_memory_takes_its_content_along(root):
    sent = pickle.dumps([root, root / "a.obj", root / "nothing"])
    code = (
        "import pickle, sys; root, file, nothing = pickle.load(sys.stdin.buffer)\n"
        "assert file.read_bytes() == b'v 0 0 0\\n' and root.is_dir() and not nothing.exists()"
    )
    subprocess.run([sys.executable, "-c", code], input=sent, check=True)


def test_without_a_url_fsspec_is_not_imported_and_with_one_the_extra_is_named(tmp_path):
    toy_dataset(tmp_path)
    code = (
        "import sys; sys.modules['fsspec'] = None; sys.argv = ['meshshard', 'info', sys.argv[1]]\n"
        "from meshshard.cli import main\n"
        "main()"
    )
    for name, status in ((tmp_path, 0), (tmp_path.as_uri(), 0), ("s3://bucket/a", 2)):
        done = subprocess.run([sys.executable, "-c", code, str(name)], capture_output=True, text=True, check=False)
        assert done.returncode == status, done.stderr
    assert "this command needs fsspec, which comes with: pip install 'meshshard[remote]'" in done.stderr
