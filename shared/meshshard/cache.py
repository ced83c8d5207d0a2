"""Copies of remote shards on this machine. A copy is named after its sha256, so it never grows old."""

import os
import secrets
from pathlib import Path

from meshshard.errors import InvalidShard
from meshshard.files import TEMPORARY_PREFIX, sha256_of_file
from meshshard.reader import Shard, ShardContent
from meshshard.remote import RemotePath

CACHE_VARIABLE = "MESHSHARD_CACHE"


def open_shard(path: Path, sha256: str) -> Shard:
    """The shard at a path, which is copied into the cache when it is first touched if it lies behind a URL."""
    return RemoteShard(path, sha256) if isinstance(path, RemotePath) else Shard(path, sha256)


class RemoteShard(Shard):
    """A shard behind a URL. InvalidShard, when it is touched: it cannot be had, or it is not what the index says."""

    def __init__(self, url: RemotePath, sha256: str) -> None:
        super().__init__(url, sha256)
        self._url = url
        self._copy = cache_folder() / f"{sha256}.h5"

    def _open(self) -> ShardContent:
        if not _is_whole(self._copy):
            _fetch(self._url, self._copy)
        return Shard(self._copy)._open()  # which was held against its sha256 just now


def cache_folder() -> Path:
    """$MESHSHARD_CACHE, or the user's own. What is in it may be deleted at any time."""
    if named := os.environ.get(CACHE_VARIABLE):
        return Path(named)
    from platformdirs import user_cache_path

    return user_cache_path("meshshard") / "shards"


def _is_whole(copy: Path) -> bool:
    return copy.is_file() and sha256_of_file(copy) == copy.stem


def _fetch(url: RemotePath, copy: Path) -> None:
    """Put a shard where its sha256 says, in one step: several processes may do so at once."""
    copy.parent.mkdir(parents=True, exist_ok=True)
    temporary = copy.with_name(f"{TEMPORARY_PREFIX}{secrets.token_hex(4)}-{copy.name}")
    try:
        url.copy_to(temporary)
        if (found := sha256_of_file(temporary)) != copy.stem:
            raise InvalidShard(f"{url}: its sha256 is {found}, the index says {copy.stem}; copy it there again")
        temporary.replace(copy)
    except OSError as error:
        raise InvalidShard(f"{url}: the shard cannot be had: {error.strerror}; try again") from error
    finally:
        temporary.unlink(missing_ok=True)
