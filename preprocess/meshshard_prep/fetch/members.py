"""What may be unpacked: names that stay below the folder, each once, of a size that is plausible and fits."""

import posixpath
import re
from pathlib import PurePosixPath

from meshshard.errors import UsageError

RATIO = 100
"""How many times larger than the archive its content may be. Meshes shrink to a third, labels to a fiftieth."""

FLOOR = 64 << 20
"""Bytes that any archive may hold."""

MOST = 1_000_000
"""Members of an archive."""

LONGEST = 255
"""Bytes of one part of a name."""


class Members:
    """The members of one archive, as they are met. Every method raises UsageError for what must not be unpacked."""

    def __init__(self, archive: str, packed: int, free: int) -> None:
        """`packed`: size of the archive. `free`: bytes that the disk has left."""
        self.archive, self.packed, self.free = archive, packed, free
        self.files: set[PurePosixPath] = set()
        self.folders: set[PurePosixPath] = {PurePosixPath()}
        self.links: dict[PurePosixPath, PurePosixPath] = {}
        self.total = 0
        self.count = 0

    def refuse(self, why: str) -> UsageError:
        """The error that refuses the archive."""
        return UsageError(f"{self.archive} is not unpacked: {why}")

    def file(self, name: str, size: int) -> PurePosixPath | None:
        """Where a file of `size` bytes goes; None for what the Finder adds to archives."""
        path = self._path(name)
        if path is None:
            return None
        self._claim(path)
        self.files.add(path)
        self.weigh(size)
        return path

    def folder(self, name: str) -> PurePosixPath | None:
        """Where a folder goes; None for what the Finder adds."""
        path = self._path(name)
        if path is not None:
            if path in self.files or path in self.links:
                raise self.refuse(f"it holds {str(path)!r} twice, as a file and as a folder")
            self._enter(path)
        return path

    def link(self, name: str, target: str, *, symbolic: bool) -> None:
        """Note a link, which becomes a copy of the file it names: a name of the archive, or seen from the link."""
        path = self._path(name)
        if path is None:
            return
        self._claim(path)
        whole = posixpath.normpath(posixpath.join(path.parent.as_posix(), target) if symbolic else target)
        self.links[path] = PurePosixPath(whole)

    def check_links(self) -> None:
        """Each link names a file of the archive."""
        for path, target in self.links.items():
            if target not in self.files:
                raise self.refuse(f"{str(path)!r} is a link to {str(target)!r}, which is no file of the archive")

    def weigh(self, size: int) -> None:
        """Add to what is unpacked."""
        self.total += size
        if size < 0:
            raise self.refuse(f"it is damaged: a member of {size} bytes")
        if self.total > max(FLOOR, RATIO * self.packed):
            raise self.refuse(
                f"its {self.packed:,} bytes would become more than {self.total:,}, over {RATIO} times as many"
            )
        if self.total > self.free:
            raise self.refuse(f"it needs more than {self.total:,} bytes, and the disk has {self.free:,} free")

    def _path(self, name: str) -> PurePosixPath | None:
        self.count += 1
        if self.count > MOST:
            raise self.refuse(f"it has more than {MOST:,} members")
        path = PurePosixPath(name)
        if (
            path.is_absolute()
            or ".." in path.parts
            or re.search(r"[\\\x00-\x1f\x7f]|^[A-Za-z]:", name)
            or any(len(part.encode()) > LONGEST for part in path.parts)
        ):
            raise self.refuse(f"the name {name[:200]!r} leads outside, or is none for a file")
        if "__MACOSX" in path.parts or path.name == ".DS_Store" or path.name.startswith("._"):
            return None
        return path

    def _claim(self, path: PurePosixPath) -> None:
        if path in self.files or path in self.links or path in self.folders:
            raise self.refuse(f"it holds {str(path)!r} twice")
        self._enter(path.parent)

    def _enter(self, folder: PurePosixPath) -> None:
        for above in (folder, *folder.parents):
            if above in self.files or above in self.links:
                raise self.refuse(f"it holds {str(above)!r} as a file and as a folder")
            self.folders.add(above)
