"""Zip and tar archives into a new folder, as plain files and folders; the archive may be hostile."""

import errno
import gzip
import shutil
import stat
import tarfile
import zipfile
import zlib
from pathlib import Path
from typing import Protocol, runtime_checkable

from meshshard_prep.fetch.download import title_of_page
from meshshard_prep.fetch.members import Members

PIECE = 1 << 18
LARGEST_HEADER = 1 << 20
"""Bytes of one header of a tar archive; tarfile itself would take any number into memory."""

LONGEST_LINK = 4096
RESERVE = 64 << 20
"""Bytes that are left free on the disk."""

OTHERS = {
    b"7z\xbc\xaf\x27\x1c": "7z",
    b"Rar!": "rar",
    b"BZh": "bzip2",
    b"\xfd7zXZ": "xz",
    b"\x28\xb5\x2f\xfd": "zstd",
}
"""How archives begin that are not unpacked here."""


@runtime_checkable
class _Stream(Protocol):
    """What files, and members of archives, have in common."""

    def read(self, size: int, /) -> bytes: ...
    def seek(self, at: int, /) -> int: ...
    def tell(self) -> int: ...


def unpack(archive: Path, folder: Path) -> None:
    """Unpack into `folder`, which is made. Nothing is ever written outside, and no link is made: a link to a file of
    the archive becomes a copy. UsageError says why an archive is refused; what was unpacked until then stays.
    """
    size = archive.stat().st_size
    folder.mkdir()
    members = Members(archive.name, size, max(0, shutil.disk_usage(folder).free - RESERVE))
    with archive.open("rb") as stream:
        head = stream.read(4096)
    try:
        if head[:4] in (b"PK\x03\x04", b"PK\x05\x06"):
            _unzip(archive, folder, members)
        elif head[:2] == b"\x1f\x8b":
            with gzip.open(archive) as unpacked:
                _untar(unpacked, folder, members)
        elif head[257:262] == b"ustar":
            with archive.open("rb") as stream:
                _untar(stream, folder, members)
        else:
            raise members.refuse(_what(head))
    except (zipfile.BadZipFile, tarfile.TarError, zlib.error, EOFError, RecursionError) as error:
        raise members.refuse(f"it is damaged or cut short ({error})") from error
    except NotImplementedError as error:
        raise members.refuse(f"it is packed in a way that is not read here ({error})") from error
    except OSError as error:
        if error.errno not in (None, errno.EINVAL):  # those are of gzip, and of places before the file's begin
            raise
        raise members.refuse(f"it is damaged or cut short ({error})") from error
    except UnicodeError as error:
        raise members.refuse("a name in it is not UTF-8") from error
    members.check_links()
    for path, target in members.links.items():
        members.weigh((folder / target).stat().st_size)
        shutil.copyfile(folder / target, _made(folder / path))


def _what(head: bytes) -> str:
    """Why something that is neither zip nor tar is not unpacked."""
    if (title := title_of_page(head)) is not None:
        return f"it is a web page (titled {title!r}), as a browser saves it where a login or a click is asked for"
    for start, kind in OTHERS.items():
        if head.startswith(start):
            return f"{kind} is not read here; unpack it with the program of that name, and zip the folder"
    return "it is neither a zip nor a tar archive"


def _unzip(archive: Path, folder: Path, members: Members) -> None:
    with zipfile.ZipFile(archive) as opened:
        for info in opened.infolist():
            name, kind = _zip_name(info), stat.S_IFMT(info.external_attr >> 16)
            if info.flag_bits & 1:
                raise members.refuse(f"{name!r} in it is encrypted; unpack it with the password, and zip the folder")
            if name.endswith("/"):
                _make(folder, members.folder(name))
                continue
            if kind not in (0, stat.S_IFREG, stat.S_IFLNK):
                raise members.refuse(f"{name!r} in it is a device or the like")
            with opened.open(info) as source:
                if kind == stat.S_IFLNK:
                    members.link(name, source.read(LONGEST_LINK).decode(), symbolic=True)
                elif path := members.file(name, info.file_size):
                    _write(source, folder / path, info.file_size)


def _zip_name(info: zipfile.ZipInfo) -> str:
    """The whole name; zipfile ends it at a zero byte, and takes what has no mark of UTF-8 for the DOS code page."""
    return info.orig_filename if info.flag_bits & 0x800 else info.orig_filename.encode("cp437").decode()


def _untar(stream: _Stream, folder: Path, members: Members) -> None:
    bounded = _Bounded(stream)
    with tarfile.open(fileobj=bounded, mode="r:", encoding="utf-8", errors="strict") as opened:  # type: ignore[call-overload]
        for info in opened:
            if info.isdir():
                _make(folder, members.folder(info.name))
            elif info.issym() or info.islnk():
                members.link(info.name, info.linkname, symbolic=info.issym())
            elif not info.isreg():
                raise members.refuse(f"{info.name!r} in it is a device or the like")
            elif path := members.file(info.name, info.size):
                source = opened.extractfile(info)
                assert source is not None
                with source:
                    _write(source, folder / path, info.size)
        bounded.seek(opened.offset)  # tarfile takes a header that it cannot read for the end
        end = bounded.read(tarfile.BLOCKSIZE)
        if not end or end.strip(b"\0"):
            raise tarfile.ReadError("the end mark is missing")


class _Bounded:
    """A stream that tarfile cannot read too much of at once, as a header of some gigabytes asks for."""

    def __init__(self, stream: _Stream) -> None:
        self.stream, self.seek, self.tell = stream, stream.seek, stream.tell

    def read(self, size: int) -> bytes:
        if not 0 <= size <= LARGEST_HEADER:
            raise tarfile.ReadError(f"a header of {size:,} bytes")
        return self.stream.read(size)


def _write(source: _Stream, path: Path, size: int) -> None:
    with _made(path).open("xb") as file:
        while size and (piece := source.read(min(PIECE, size))):
            file.write(piece)
            size -= len(piece)
    if size or source.read(1):
        raise EOFError(f"{path.name} has another size than the archive says")


def _made(path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    return path


def _make(folder: Path, path: object) -> None:
    if path is not None:
        (folder / str(path)).mkdir(parents=True, exist_ok=True)
