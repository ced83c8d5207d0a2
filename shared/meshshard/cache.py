"""Copies of remote shards on this machine. A copy is named after its sha256, so it never grows old."""

import os
import re
import secrets
from pathlib import Path
from typing import Any

import numpy as np

from meshshard.errors import InvalidShard
from meshshard.files import TEMPORARY_PREFIX, sha256_of_file
from meshshard.reader import Shard
from meshshard.remote import RemotePath

CACHE_VARIABLE = "MESHSHARD_CACHE"


def open_shard(path: Path, sha256: str) -> Shard:
    """The shard at a path, which is copied into the cache when it is first touched if it lies behind a URL."""
    return RemoteShard(path, sha256) if isinstance(path, RemotePath) else Shard(path, sha256)


class RemoteShard(Shard):
    """A shard behind a URL. InvalidShard, when it is touched: it cannot be had, or it is not what the index says."""

    def __init__(self, url: RemotePath, sha256: str) -> None:
        if not re.fullmatch("[0-9a-f]{64}", sha256):  # it becomes the name of a file
            raise InvalidShard(f"{url}: the index gives {sha256!r} where a sha256 should be")
        super().__init__(cache_folder() / f"{sha256}.h5")  # held against its sha256 here, not there once more
        self.url = url

    def __getstate__(self) -> dict[str, Any]:
        return super().__getstate__() | {"url": self.url}

    @property
    def columns(self) -> dict[str, np.ndarray]:
        """Every field of the shard by name, strings decoded."""
        if self._columns is None and not _is_whole(self.path):
            _fetch(self.url, self.path)
        return super().columns


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
