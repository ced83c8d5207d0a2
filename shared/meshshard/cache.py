"""Copies of remote shards on this machine. A copy is named after its sha256, so it never grows old."""

import os
import re
from pathlib import Path

from meshshard.errors import InvalidShard
from meshshard.files import sha256_of_file, temporary_beside
from meshshard.remote import RemotePath

CACHE_VARIABLE = "MESHSHARD_CACHE"


def local_copy(path: Path, sha256: str) -> Path:
    """A shard's path on this machine: itself, or of one behind a URL the copy in the cache, which is made where it is
    missing or damaged. InvalidShard: it cannot be had, or is not what the index says."""
    if not isinstance(path, RemotePath):
        return path
    if not re.fullmatch("[0-9a-f]{64}", sha256):  # it becomes the name of a file
        raise InvalidShard(f"{path}: the index gives {sha256!r} where a sha256 should be")
    copy = cache_folder() / f"{sha256}.h5"
    if not (copy.is_file() and sha256_of_file(copy) == sha256):
        _fetch(path, copy, sha256)
    return copy


def cache_folder() -> Path:
    """$MESHSHARD_CACHE, or the user's own. What is in it may be deleted at any time."""
    if named := os.environ.get(CACHE_VARIABLE):
        return Path(named)
    from platformdirs import user_cache_path

    return user_cache_path("meshshard") / "shards"


def _fetch(url: RemotePath, copy: Path, sha256: str) -> None:
    """Several processes may do so at once: what has its final name is whole."""
    copy.parent.mkdir(parents=True, exist_ok=True)
    temporary = temporary_beside(copy)
    try:
        url.copy_to(temporary)
        if (found := sha256_of_file(temporary)) != sha256:
            raise InvalidShard(f"{url}: its sha256 is {found}, the index says {sha256}; copy it there again")
        temporary.replace(copy)
    except OSError as error:
        raise InvalidShard(f"{url}: the shard cannot be had: {error.strerror}; try again") from error
    finally:
        temporary.unlink(missing_ok=True)
