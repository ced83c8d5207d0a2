"""One archive over HTTP: resumed after a break, tried again, never a web page in its place."""

import json
import re
import shutil
import time
from collections.abc import Callable
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

from meshshard.errors import MeshshardError
from meshshard.files import publish
from meshshard_prep.fetch.source import Archive

if TYPE_CHECKING:
    from requests import Response

PAUSES = (1.0, 4.0, 15.0)
"""Seconds before the tries that follow a failed one; begun anew whenever a try brought something."""

TIMEOUTS = (20.0, 60.0)
"""Seconds until a server has to accept, and to send the next piece."""

REDIRECTS = 10
PIECE = 1 << 16
PART, STATE = ".part", ".part.json"
"""Endings of what is not there in full, and of the file that says which version of which address it is."""

Tell = Callable[[str, int, int | None], None]
"""Told after each piece: name of the file, bytes so far, bytes in all if the server says."""


class NotLoaded(MeshshardError):
    """Why an archive could not be had from its address."""


class _TryAgain(Exception):
    """A failure that may pass."""


def load(archive: Archive, folder: Path, tell: Tell) -> Path:
    """The archive in a folder; what is there already in full is not loaded again, what is there in part is gone on
    with. NotLoaded: the address is dead, gives something else, or fails again and again."""
    import pooch

    pooch.get_logger().setLevel("WARNING")
    known = f"sha256:{archive.sha256}" if archive.sha256 else None
    try:
        return Path(
            pooch.retrieve(archive.url, known, archive.file, folder, downloader=_Resuming(archive, folder, tell))
        )
    except ValueError as error:  # pooch's word for another hash
        raise NotLoaded(
            f"what {archive.url} gave is not what was published, whose sha256 is {archive.sha256}"
        ) from error


def title_of_page(head: bytes) -> str | None:
    """Title of the web page that begins like this, "" for one without; None if it is none."""
    text = head.decode("latin-1").lstrip("\xef\xbb\xbf \t\r\n")
    if not re.match(r"<(!doctype html|html|head|\?xml[^>]*>\s*<!doctype html)", text, flags=re.I):
        return None
    found = re.search(r"<title[^>]*>(.*?)</title>", text, flags=re.I | re.S)
    return " ".join(found[1].split()) if found else ""


class _Resuming:
    """A downloader for pooch, which by itself begins anew after every break."""

    def __init__(self, archive: Archive, folder: Path, tell: Tell) -> None:
        self.file, self.tell = archive.file, tell
        self.part, self.state = folder / f"{archive.file}{PART}", folder / f"{archive.file}{STATE}"

    def __call__(self, url: str, output_file: str, pooch: Any, check_only: bool = False) -> None:  # noqa: ARG002
        """Have the file at `url` as `output_file`; the other arguments are pooch's."""
        failures, most = 0, 0
        while True:
            try:
                self._go_on(url)
                break
            except _TryAgain as error:
                have = self._have()
                if have > most:
                    failures, most = 0, have
                if failures == len(PAUSES):
                    raise NotLoaded(f"{url} failed {failures + 1} times in a row: {error}") from error
            time.sleep(PAUSES[failures])
            failures += 1
        self.part.replace(output_file)
        self.state.unlink()

    def _go_on(self, url: str) -> None:
        import requests
        from urllib3.exceptions import HTTPError, NameResolutionError

        known, have = self._known(url), self._have()
        version = known.get("version", "")
        headers = {"Accept-Encoding": "identity"}  # of a packed answer, no range could be asked for
        if version and have:
            if have == known["total"]:
                return
            headers |= {"Range": f"bytes={have}-", "If-Range": version}
        try:
            with requests.Session() as session:
                session.max_redirects = REDIRECTS
                with session.get(url, headers=headers, stream=True, timeout=TIMEOUTS) as response:
                    self._receive(url, response, have if version else 0, version)
        except requests.exceptions.SSLError as error:
            raise NotLoaded(f"{url} has no certificate that can be trusted: {_cause(error)}") from error
        except requests.exceptions.TooManyRedirects as error:
            raise NotLoaded(f"{url} was redirected {REDIRECTS} times and leads nowhere") from error
        except (requests.exceptions.Timeout, requests.exceptions.ConnectionError, HTTPError) as error:
            if isinstance(_cause(error), NameResolutionError):
                raise NotLoaded(
                    f"the server of {url} is not found: this machine has no network, or the address is dead"
                ) from error
            raise _TryAgain(str(_cause(error))) from error
        except (requests.exceptions.RequestException, ValueError) as error:
            raise NotLoaded(f"{url} leads to an address that cannot be loaded: {error}") from error

    def _receive(self, url: str, response: "Response", have: int, version: str) -> None:
        self._check_status(url, response)
        found = _version(response)
        first, total = _range(response)
        if response.status_code == 206 and (first != have or found not in ("", version)):
            self.part.unlink()
            raise _TryAgain("the server sent another part than was asked for")
        pieces = response.raw.stream(PIECE, decode_content=False)
        start = b""
        if response.status_code != 206:
            start = next(pieces, b"")
            if (title := title_of_page(start)) is not None:
                raise NotLoaded(f"{url} gives a web page (titled {title!r}) instead of the archive")
            have = 0
            self.part.unlink(missing_ok=True)
            publish(self.state, json.dumps({"url": url, "version": found, "total": total}).encode(), durable=False)
        free = shutil.disk_usage(self.part.parent).free
        if total is not None and total - have > free:
            raise NotLoaded(
                f"{self.file} needs {total - have:,} bytes more, and {self.part.parent} has {free:,} free"
            )
        with self.part.open("ab") as file:
            for piece in chain([start], pieces):
                file.write(piece)
                have += len(piece)
                self.tell(self.file, have, total)
        if total is not None and have != total:
            raise _TryAgain(f"the connection broke off after {have:,} of {total:,} bytes")

    def _check_status(self, url: str, response: "Response") -> None:
        said = f"{response.status_code} {response.reason}"
        if response.status_code == 416:  # what is here in part is longer than what is there
            self.part.unlink()
            raise _TryAgain(f"the server says {said}")
        if response.status_code in (408, 429) or response.status_code >= 500:
            raise _TryAgain(f"the server says {said}")
        if response.status_code not in (200, 206):
            raise NotLoaded(f"{url} is not there for a program: the server says {said}")

    def _known(self, url: str) -> dict[str, Any]:
        """What was written down when the part was begun; nothing if that was another address."""
        try:
            known = json.loads(self.state.read_bytes())
        except (FileNotFoundError, ValueError):
            return {}
        return known if known.get("url") == url else {}

    def _have(self) -> int:
        return self.part.stat().st_size if self.part.exists() else 0


def _version(response: "Response") -> str:
    """What tells one content of the address from another, byte by byte: empty if the server says nothing."""
    tag = response.headers.get("ETag", "")
    return tag if tag.startswith('"') else response.headers.get("Last-Modified", "")


def _range(response: "Response") -> tuple[int, int | None]:
    """First byte that is sent, and how many there are in all."""
    if found := re.fullmatch(r"bytes (\d+)-\d+/(\d+)", response.headers.get("Content-Range", "")):
        return int(found[1]), int(found[2])
    length = response.headers.get("Content-Length", "")
    return 0, int(length) if length.isdigit() else None


def _cause(error: Any) -> Any:
    """The innermost error that requests and urllib3 wrap."""
    while inner := next((e for e in (getattr(error, "reason", None), *error.args) if isinstance(e, Exception)), None):
        error = inner
    return error
