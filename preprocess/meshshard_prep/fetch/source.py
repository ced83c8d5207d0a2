"""Where the raw files of a data set are published."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Archive:
    """One published archive.

    `file`: its name. `url`: its address; empty where a program cannot have it: a login, a form, a page of a cloud.
    `holds`: a glob pattern; the shallowest folder inside that holds such a thing is the one that is wanted, however
    the folders around it are called. `into`: what that folder becomes below data/raw/NAME; empty: that folder itself.
    `beside`: another such pattern; what matches may lie in another part of the archive, and is put beside the rest.
    `size` in bytes and `sha256`: where they are known.
    """

    file: str
    holds: str
    url: str = ""
    into: str = ""
    beside: str = ""
    size: int = 0
    sha256: str = ""


@dataclass(frozen=True, kw_only=True)
class Source:
    """The archives of a data set, and the `page` that people read.

    `read_in`: repository and file where the addresses were read. `by_hand`: what to do at the page, as a sentence,
    where an archive has no address. No archives: what is published cannot be unpacked here, and `by_hand` tells how.
    """

    page: str
    read_in: str
    archives: tuple[Archive, ...] = ()
    by_hand: str = ""
