"""Files behind a URL, s3://bucket/folder say, as paths: what asks a path asks fsspec there. Reading only."""

import contextlib
import errno
import io
import os
import re
import stat
from collections.abc import Generator, Iterator
from fnmatch import fnmatchcase
from pathlib import Path, PosixPath
from typing import Any, NoReturn
from urllib.parse import urlsplit

from meshshard.errors import UsageError

IN_MEMORY = "memory://"
_URL = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*://")


def is_url(name: str) -> bool:
    """Whether a name begins like a URL."""
    return _URL.match(name) is not None


def to_path(name: str | Path) -> Path:
    """A name as a path: plain for this machine's files (also as file:///folder), a RemotePath for other URLs.

    UsageError: a URL without host or bucket, or of a kind that is not installed. ModuleNotFoundError: no fsspec.
    """
    if isinstance(name, Path):
        return name
    if not is_url(name):
        return Path(name)
    scheme, rest = name.split("://", 1)
    if scheme == "file":
        if not rest.startswith("/"):
            raise UsageError(f"{name}: a file URL has three slashes, as file:///home/me/meshes")
        from urllib.request import url2pathname  # brings ssl and http: a fifteenth of what --help takes

        return Path(url2pathname(urlsplit(name).path))
    if not rest or (rest.startswith("/") and scheme != "memory"):
        raise UsageError(f"{name} names no host or bucket; a URL is {scheme}://bucket/folder")
    from fsspec import get_filesystem_class  # an extra, which only URLs need

    try:
        get_filesystem_class(scheme)
    except (ImportError, ValueError) as error:
        raise UsageError(f"{name}: {error}; for s3:// it is: pip install 'meshshard[remote]'") from error
    return RemotePath(name)


def local_folder(name: str | Path) -> Path:
    """A name as a path of this machine. UsageError for other URLs: nothing is written there."""
    path = to_path(name)
    if isinstance(path, RemotePath):
        raise UsageError(f"{name}: results are written to a folder of this machine; copy them there later")
    return path


def listed(path: Path) -> Path:
    """The same path; a remote one after everything below it was listed at once: what is asked about its files from
    then on, in this process, needs no request. UsageError: it cannot be listed."""
    if isinstance(path, RemotePath):
        try:
            path.list_below()
        except OSError as error:
            raise UsageError(f"{path} cannot be read: {error.strerror}") from error
    return path


class RemotePath(PosixPath):
    """A path that begins with a URL's scheme and host. Names work as in pathlib, and what reads asks fsspec.

    Every failure is an OSError with its cause in `strerror`, whatever the file system raised. What is not overridden
    here fails with TypeError, for `__fspath__` gives nothing to this machine's file system. Credentials and endpoints
    come from the environment, never from the path, so that a path may be sent to any worker and shown to anyone.
    """

    def __str__(self) -> str:
        return super().__str__().replace(":/", "://", 1)  # pathlib keeps one slash of two

    def __fspath__(self) -> NoReturn:
        raise TypeError(f"{self} is not on this machine")

    def __reduce__(self) -> tuple[Any, ...]:
        """Sent to another process it is opened anew; a file of memory:// takes its content along."""
        url = str(self)
        return _arrived, (url, self.read_bytes() if url.startswith(IN_MEMORY) and self.is_file() else None)

    def relative_to(self, *other: Any, **options: Any) -> Path:  # type: ignore[override]
        """The part below `other`, which is no URL any more."""
        return Path(*super().relative_to(*other, **options).parts)

    def resolve(self, strict: bool = False) -> "RemotePath":  # noqa: ARG002  pathlib's signature
        """Itself."""
        return self

    def stat(self, **_options: Any) -> os.stat_result:
        """Kind and size; the rest is 0."""
        with self._there() as (system, path):
            found = system.info(path)
        kind = stat.S_IFDIR if found["type"] == "directory" else stat.S_IFREG
        return os.stat_result((kind, 0, 0, 0, 0, 0, found["size"] or 0, 0, 0, 0))

    def exists(self, **_options: Any) -> bool:
        """Whether there is a file or folder. OSError where that cannot be known."""
        return self._kind() is not None

    def is_file(self, **_options: Any) -> bool:
        """Whether it is a file. OSError where that cannot be known."""
        return self._kind() == stat.S_IFREG

    def is_dir(self, **_options: Any) -> bool:
        """Whether something lies below. OSError where that cannot be known."""
        return self._kind() == stat.S_IFDIR

    def is_symlink(self) -> bool:
        """No: there are none."""
        return False

    def iterdir(self) -> Generator["RemotePath", None, None]:
        """Files and folders in this one."""
        with self._there() as (system, path):
            names = system.ls(path, detail=False)
        # a folder lists its own placeholder; and s3fs, after it listed all below, some folders twice
        ends = {name.rstrip("/").rsplit("/", 1)[-1]: None for name in names if name.rstrip("/") != path}
        yield from (self / end for end in ends)

    def glob(self, pattern: str, **_options: Any) -> Generator["RemotePath", None, None]:
        """What lies in this folder and has a name like `pattern`; nothing where there is no such folder."""
        with contextlib.suppress(FileNotFoundError):
            yield from (path for path in self.iterdir() if fnmatchcase(path.name, pattern))

    def open(self, mode: str = "r", buffering: int = -1, **text: Any) -> Any:  # type: ignore[override]  # noqa: ARG002
        """A file to read, "r" or "rb", of content that was read whole."""
        assert mode in ("r", "rb"), mode
        with self._there() as (system, path):
            content = io.BytesIO(system.cat_file(path))
        return content if mode == "rb" else io.TextIOWrapper(content, **text)

    def list_below(self) -> None:
        """Forget what was known, and have fsspec remember everything below."""
        with self._there() as (system, path):
            system.invalidate_cache()
            system.find(path)

    def copy_to(self, target: Path) -> None:
        """Copy a file to this machine. Where it fails, a part of it may be left."""
        with self._there() as (system, path):
            system.get_file(path, str(target))

    def _kind(self) -> int | None:
        try:
            return stat.S_IFMT(self.stat().st_mode)
        except (FileNotFoundError, NotADirectoryError):
            return None

    @contextlib.contextmanager
    def _there(self) -> Iterator[tuple[Any, str]]:
        """The file system, and the path on it."""
        from fsspec.core import url_to_fs

        url = str(self)
        if not is_url(url):
            raise FileNotFoundError(errno.ENOENT, "a path that left its URL", url)
        try:
            yield url_to_fs(url)
        except Exception as error:  # each file system has errors of its own, most of them no OSError
            raise _os_error(error, url) from error


def _os_error(error: Exception, url: str) -> OSError:
    if isinstance(error, FileNotFoundError):
        return FileNotFoundError(errno.ENOENT, f"{os.strerror(errno.ENOENT)} ({error})", url)
    if isinstance(error, OSError) and error.strerror:
        return OSError(error.errno, error.strerror, url)
    code = errno.EACCES if isinstance(error, PermissionError) else errno.EIO
    return OSError(code, f"{type(error).__name__}: {error}", url)


def _arrived(url: str, content: bytes | None) -> RemotePath:
    path = RemotePath(url)
    if content is not None:
        with path._there() as (system, name):
            system.pipe_file(name, content)
    return path
