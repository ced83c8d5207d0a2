"""Files that are old or new, never something between."""

import contextlib
import errno
import hashlib
import os
import secrets
import socket
import time
from collections.abc import Iterator
from io import BytesIO, FileIO
from pathlib import Path

from meshshard.errors import UsageError

TEMPORARY_PREFIX = ".tmp-"
LOCK_NAME = ".lock"


def sha256_of(data: bytes) -> str:
    """Hexadecimal sha256 of bytes."""
    return hashlib.sha256(data).hexdigest()


def sha256_of_file(path: Path) -> str:
    """Hexadecimal sha256 of a file, read in pieces."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def open_regular(path: Path) -> FileIO | BytesIO:
    """A file to read, unbuffered; of one behind a URL, its content. OSError for anything but a regular file: a pipe
    waits for its writer for ever."""
    if path.exists() and not path.is_file():
        raise OSError(errno.EINVAL, "it is no regular file", str(path))
    return path.open("rb", buffering=0)


def temporary_beside(path: Path) -> Path:
    """A name of its own, in the same folder, for what is to become `path` by a rename."""
    return path.with_name(f"{TEMPORARY_PREFIX}{secrets.token_hex(4)}-{path.name}")


def publish(path: Path, data: bytes, *, durable: bool = True) -> None:
    """Write `data` under its final name in one step that survives a power cut: own file, fsync, rename, fsync.

    Not `durable`, the step survives the death of the process, and after a power cut the content may be anything.
    OSError (disk full, say) leaves the old file, or none, and no temporary one.
    """
    temporary = temporary_beside(path)
    descriptor = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o644)
    try:
        try:
            view = memoryview(data)
            while view:
                view = view[os.write(descriptor, view) :]
            if durable:
                os.fsync(descriptor)
        finally:
            os.close(descriptor)
        temporary.replace(path)
    except BaseException:
        with contextlib.suppress(OSError):
            temporary.unlink()
        raise
    if durable:
        sync_folder(path.parent)


@contextlib.contextmanager
def lock_folder(folder: Path) -> Iterator[None]:
    """Make a folder, hold it alone, and remove temporary files that killed processes left in it. The lock is the
    system's: it ends with its holder, however that ends. UsageError names another process that holds it."""
    import fcntl  # POSIX only: who only reads shards never locks, and may do so anywhere

    folder.mkdir(parents=True, exist_ok=True)
    _check_lock(folder)
    with (folder / LOCK_NAME).open("a+") as file:
        for again in (True, True, False):
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                break
            except BlockingIOError:
                who = holder(folder)
                if who or not again:
                    raise UsageError(
                        f"another run is writing to {folder}: {who}; wait for it, or choose another folder"
                    ) from None
                time.sleep(0.1)  # somebody only asked who holds it
            except OSError as error:
                raise UsageError(
                    f"{folder}: its file system cannot lock files ({error.strerror}); choose a folder on another one"
                ) from error
        file.truncate(0)
        file.write(f"process {os.getpid()} on {socket.gethostname()} since {time.strftime('%Y-%m-%d %H:%M:%S')}")
        file.flush()
        for path in folder.glob(f"{TEMPORARY_PREFIX}*"):
            path.unlink()
        yield


def _check_lock(folder: Path) -> None:
    path = folder / LOCK_NAME
    if path.exists() and not path.is_file():
        raise UsageError(f"{path} is no regular file, and a run locks it; delete it")


def holder(folder: Path) -> str:
    """Who holds a folder with `lock_folder`: process, machine, since when; empty if nobody does."""
    import fcntl

    _check_lock(folder)
    try:
        with (folder / LOCK_NAME).open() as file:
            try:
                fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
            except BlockingIOError:
                return file.read()
    except FileNotFoundError:
        pass
    return ""


def sync_folder(folder: Path) -> None:
    """Make renames and removals in a folder durable."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
