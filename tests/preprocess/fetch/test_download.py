"""Downloads from a server that behaves, and from servers that do not."""

import hashlib
import json
import shutil
import socket
from types import SimpleNamespace

import numpy as np
import pytest
import requests
from http_server import content, status

from meshshard_prep.fetch import download
from meshshard_prep.fetch.download import NotLoaded, load, title_of_page
from meshshard_prep.fetch.source import Archive

DATA = np.random.default_rng(0).bytes(100_000)
OTHER = np.random.default_rng(1).bytes(90_000)


def ignore(file, done, total):
    """Of what is told, nothing."""


def fetched(url, folder, tell=ignore, **known):
    return load(Archive(file="a.zip", holds="*", url=url, **known), folder, tell).read_bytes()


def ranges(server):
    return [headers.get("Range") for _, headers in server.requests]


def test_an_archive_is_loaded_and_told_of(server, tmp_path):
    told = []
    url = server.answer("/a.zip", content(DATA))
    assert fetched(url, tmp_path, lambda *words: told.append(words)) == DATA
    assert told[-1] == ("a.zip", 100_000, 100_000)
    assert [path.name for path in tmp_path.iterdir()] == ["a.zip"]


def test_a_loaded_archive_is_not_loaded_again(server, tmp_path):
    url = server.answer("/a.zip", content(DATA), status(404))
    assert fetched(url, tmp_path) == fetched(url, tmp_path) == DATA
    assert len(server.requests) == 1


@pytest.mark.parametrize("tag", ['"1"', ""], ids=["by ETag", "by date"])
def test_a_broken_download_goes_on_where_it_broke_off(server, tmp_path, tag):
    date = {"Last-Modified": "Mon, 06 Jan 2025 10:00:00 GMT"}
    version = tag or date["Last-Modified"]

    def whole(cut):
        return content(DATA, tag=version, cut=cut, head=() if tag else date)

    url = server.answer("/a.zip", whole(30_000), whole(20_000), whole(None))
    assert fetched(url, tmp_path) == DATA
    assert ranges(server) == [None, "bytes=30000-", "bytes=50000-"]
    assert {headers.get("If-Range") for _, headers in server.requests[1:]} == {version}


def test_a_weak_tag_is_no_version(server, tmp_path):
    url = server.answer("/a.zip", content(DATA, tag='W/"1"', cut=30_000), content(DATA, tag='W/"1"'))
    assert fetched(url, tmp_path) == DATA
    assert ranges(server) == [None, None]


def test_without_ranges_a_broken_download_begins_anew(server, tmp_path):
    url = server.answer("/a.zip", content(DATA, ranges=False, cut=30_000), content(DATA, ranges=False))
    assert fetched(url, tmp_path) == DATA
    assert ranges(server) == [None, "bytes=30000-"]


def test_what_changed_meanwhile_is_loaded_whole(server, tmp_path):
    url = server.answer("/a.zip", content(DATA, cut=30_000), content(OTHER, tag='"2"'))
    assert fetched(url, tmp_path) == OTHER


def test_a_part_of_another_content_is_never_put_behind_the_first(server, tmp_path):
    def careless(handler):  # a range of the new content, whatever If-Range says
        handler.headers.replace_header("If-Range", '"2"')
        content(OTHER, tag='"2"')(handler)

    url = server.answer("/a.zip", content(DATA, cut=30_000), careless, content(OTHER, tag='"2"'))
    assert fetched(url, tmp_path) == OTHER


def test_a_part_from_another_byte_is_not_taken(server, tmp_path):
    shifted = content(DATA, head={"Content-Range": "bytes 7-99999/100000"})
    url = server.answer("/a.zip", content(DATA, cut=30_000), shifted, content(DATA))
    assert fetched(url, tmp_path) == DATA


def test_a_part_longer_than_the_file_is_dropped(server, tmp_path):
    url = server.answer("/a.zip", content(DATA, cut=30_000), status(416), content(DATA))
    assert fetched(url, tmp_path) == DATA
    assert ranges(server) == [None, "bytes=30000-", None]


def test_an_earlier_process_is_gone_on_with(server, tmp_path):
    url = server.answer("/a.zip", content(DATA, cut=30_000), status(404))
    with pytest.raises(NotLoaded, match="404"):
        fetched(url, tmp_path)
    assert (tmp_path / "a.zip.part").stat().st_size == 30_000
    server.answer("/a.zip", content(DATA))
    assert fetched(url, tmp_path) == DATA
    assert ranges(server)[-1] == "bytes=30000-"


def test_killed_after_the_last_byte_nothing_is_loaded_again(server, tmp_path):
    url = server.answer("/a.zip", status(404))
    (tmp_path / "a.zip.part").write_bytes(DATA)
    (tmp_path / "a.zip.part.json").write_text(json.dumps({"url": url, "version": '"1"', "total": len(DATA)}))
    assert fetched(url, tmp_path) == DATA
    assert server.requests == []


@pytest.mark.parametrize("state", ["", '{"url": "http://127.0.0.1/b.zip", "version": "1", "total": 9}'])
def test_a_part_that_nothing_is_known_about_is_not_used(server, tmp_path, state):
    (tmp_path / "a.zip.part").write_bytes(b"something else")
    (tmp_path / "a.zip.part.json").write_text(state)
    assert fetched(server.answer("/a.zip", content(DATA)), tmp_path) == DATA


def test_a_slow_server_is_waited_for(server, tmp_path, monkeypatch):
    monkeypatch.setattr(download, "TIMEOUTS", (1.0, 0.2))
    url = server.answer("/a.zip", content(DATA[:20_000], pause=0.03))
    assert fetched(url, tmp_path) == DATA[:20_000]


def test_a_silent_server_is_not(server, tmp_path, monkeypatch):
    monkeypatch.setattr(download, "TIMEOUTS", (0.1, 0.05))
    url = server.answer("/a.zip", content(DATA, pause=1.0))
    with pytest.raises(NotLoaded, match=r"failed 4 times in a row: .*timed out"):
        fetched(url, tmp_path)


def test_tries_are_counted_anew_after_each_gain(server, tmp_path):
    url = server.answer("/a.zip", *(content(DATA, cut=10_000) for _ in range(9)), content(DATA))
    assert fetched(url, tmp_path) == DATA
    assert len(server.requests) == 10


@pytest.mark.parametrize("code", [408, 429, 500, 503])
def test_what_may_pass_is_tried_again(server, tmp_path, code):
    url = server.answer("/a.zip", status(code), status(code), content(DATA))
    assert fetched(url, tmp_path) == DATA


def test_but_not_for_ever(server, tmp_path):
    with pytest.raises(NotLoaded, match="failed 4 times in a row: the server says 503"):
        fetched(server.answer("/a.zip", status(503)), tmp_path)
    assert len(server.requests) == 4


@pytest.mark.parametrize("code", [401, 403, 404, 410])
def test_what_will_not_pass_is_asked_once(server, tmp_path, code):
    with pytest.raises(NotLoaded, match=f"the server says {code}"):
        fetched(server.answer("/a.zip", status(code)), tmp_path)
    assert len(server.requests) == 1


@pytest.mark.parametrize("how", ["as text/html", "as an archive", "without length"])
def test_a_web_page_is_no_archive(server, tmp_path, how):
    page = b"\n<!DOCTYPE html><html><head><title>Google Drive -\n Virus scan warning</title></head></html>"
    kind = "text/html; charset=utf-8" if how == "as text/html" else "application/zip"
    url = server.answer("/a.zip", content(page, kind=kind, length=how != "without length"))
    with pytest.raises(NotLoaded, match=r"gives a web page \(titled 'Google Drive - Virus scan warning'\)"):
        fetched(url, tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_titles_of_pages():
    assert title_of_page(b"<html><body>log in") == ""
    assert title_of_page(b"PK\x03\x04<html>") is None
    assert title_of_page(b"<?xml version='1.0'?><!DOCTYPE html><title>x</title>") == "x"
    assert title_of_page(b"") is None


def test_without_length_the_end_is_the_end(server, tmp_path):
    told = []
    url = server.answer("/a.zip", content(DATA, length=False))
    assert fetched(url, tmp_path, lambda *words: told.append(words)) == DATA
    assert told[-1] == ("a.zip", 100_000, None)


def test_an_empty_answer_is_an_empty_file(server, tmp_path):
    assert fetched(server.answer("/a.zip", content(b"")), tmp_path) == b""


def test_the_published_hash_is_checked(server, tmp_path):
    url = server.answer("/a.zip", content(OTHER), content(DATA))
    right = hashlib.sha256(DATA).hexdigest()
    with pytest.raises(NotLoaded, match=f"not what was published, whose sha256 is {right}"):
        fetched(url, tmp_path, sha256=right)
    assert list(tmp_path.iterdir()) == []
    assert fetched(url, tmp_path, sha256=right) == DATA


def test_redirects_are_followed(server, tmp_path):
    server.answer("/b.zip", content(DATA))
    assert fetched(server.answer("/a.zip", status(302, Location="/b.zip")), tmp_path) == DATA


@pytest.mark.parametrize(
    ("location", "message"),
    [("/a.zip", "was redirected 10 times"), ("file:///etc/passwd", "cannot be loaded"), ("http://[", "cannot be")],
)
def test_redirects_that_lead_nowhere(server, tmp_path, location, message):
    with pytest.raises(NotLoaded, match=message):
        fetched(server.answer("/a.zip", status(302, Location=location)), tmp_path)


def test_a_server_that_is_not_there(tmp_path):
    with socket.create_server(("127.0.0.1", 0)) as listening:
        port = listening.getsockname()[1]
    with pytest.raises(NotLoaded, match=r"failed 4 times in a row: .*Connection refused"):
        fetched(f"http://127.0.0.1:{port}/a.zip", tmp_path)


def test_a_name_that_is_not_found(tmp_path, monkeypatch):
    def no_such_name(*_arguments, **_options):
        raise socket.gaierror(-2, "Name or service not known")

    monkeypatch.setattr(socket, "getaddrinfo", no_such_name)
    with pytest.raises(NotLoaded, match="is not found: this machine has no network, or the address is dead"):
        fetched("http://gone.invalid/a.zip", tmp_path)


def test_a_server_without_certificate(server, tmp_path):
    url = server.answer("/a.zip", content(DATA)).replace("http:", "https:")
    with pytest.raises(NotLoaded, match="no certificate that can be trusted"):
        fetched(url, tmp_path)


def test_a_disk_too_small_is_told_before_it_is_full(server, tmp_path, monkeypatch):
    monkeypatch.setattr(shutil, "disk_usage", lambda _folder: SimpleNamespace(free=99_999))
    with pytest.raises(NotLoaded, match=r"needs 100,000 bytes more, and .* has 99,999 free"):
        fetched(server.answer("/a.zip", content(DATA)), tmp_path)


def test_no_test_here_reaches_another_machine():
    with pytest.raises(AssertionError, match="wants to reach"):
        requests.get("http://example.com", timeout=1)
    with pytest.raises(AssertionError, match="wants to reach"):
        socket.create_connection(("192.0.2.1", 80), timeout=1)
