"""The site of the documents: built without a warning, whole without network, fit for all readers."""

import json
import os
import re
import subprocess
import sys
import threading
from functools import partial
from html.parser import HTMLParser
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from itertools import pairwise
from pathlib import Path
from urllib.parse import unquote

import pytest
from accessible import findings
from effort import SOAKING

from meshshard.cli import VERBS

ROOT = Path(__file__).parents[1]
LOADED = {"script": "src", "img": "src", "iframe": "src", "link": "href"}
"""Element -> where it names what a browser loads with the page."""


WITHOUT_END = {"br", "hr", "img", "input", "link", "meta"}


class Page(HTMLParser):
    """What is checked of a page: levels of its headings, alternative texts, what it loads, where its links lead, and
    the kinds of its elements: the names and classes of each and of what it stands in."""

    def __init__(self, text):
        super().__init__()
        self.headings, self.pictures, self.loaded = [], [], []
        self.links, self.places = [], {""}
        self.kinds, self._open = set(), [("", "")]
        self.feed(text)

    def handle_endtag(self, tag):
        while len(self._open) > 1 and self._open.pop()[0] != tag:
            pass

    def handle_starttag(self, tag, attrs):
        found = dict(attrs)
        kind = tag, found.get("class") or ""
        self.kinds.add((self._open[-1], kind))
        if tag not in WITHOUT_END:
            self._open.append(kind)
        if re.fullmatch("h[1-6]", tag):
            self.headings.append(int(tag[1]))
        if tag == "img":
            self.pictures.append(found.get("alt") or "")
        self.places |= {found.get("id") or "", found.get("name") or ""}
        if tag == "a" and found.get("href"):
            self.links.append(found["href"])
        if tag in LOADED and found.get("rel") not in ("canonical", "next", "prev"):
            self.loaded.append(found.get(LOADED[tag]) or "")


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    folder = tmp_path_factory.mktemp("site")
    call = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(folder)]
    environment = os.environ | {"NO_MKDOCS_2_WARNING": "1"}
    done = subprocess.run(call, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "WARNING" not in done.stderr
    return folder


@pytest.fixture(scope="module")
def address(site):
    """Where a server shows it: the page of what is not found is for servers alone."""
    handler = partial(QuietHandler, directory=str(site))
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()


class QuietHandler(SimpleHTTPRequestHandler):
    """Serves files, and says nothing."""

    def log_message(self, *_):
        pass


@pytest.fixture(scope="module")
def pages(site):
    return {str(path.relative_to(site)): Page(path.read_text()) for path in site.rglob("*.html")}


def test_every_document_is_a_page(site):
    for path in (ROOT / "docs").rglob("*.md"):
        name = "index" if path.stem == "README" else path.stem
        assert (site / path.relative_to(ROOT / "docs")).with_name(f"{name}.html").exists()


def test_nothing_is_loaded_from_elsewhere(site, pages):
    assert {url for page in pages.values() for url in page.loaded if re.match("(https?:)?//", url)} == set()
    styles = "".join(path.read_text() for path in site.rglob("*.css"))
    assert re.findall(r"""(?:url\(|@import )["']?(?:https?:)?//[^)]*""", styles) == []


def test_every_picture_has_an_alternative_text(pages):
    texts = [text for page in pages.values() for text in page.pictures]
    assert len(texts) >= 5
    assert [text for text in texts if len(text) < 15] == []


def test_every_link_leads_somewhere(site, pages):
    broken, followed = [], 0
    for name, page in pages.items():
        for link in page.links if name != "404.html" else ():  # which a server shows in any folder
            path, _, place = unquote(link).partition("#")
            if re.match(r"[a-z]+:", path):
                continue
            target = (site / name).parent.joinpath(path).resolve() if path else site / name
            there = pages.get(os.path.relpath(target, site))
            followed += 1
            if not target.is_file() or (there and place not in there.places):
                broken.append((name, link))
    assert broken == []
    assert followed > 1000


def test_every_link_of_the_readme_leads_somewhere():
    links = re.findall(r"\]\((?!https?:)([^)#]+)\)", (ROOT / "README.md").read_text())
    assert [link for link in links if not (ROOT / link).exists()] == []
    assert len(links) > 20


def test_headings_begin_with_one_title_and_leave_out_no_level(pages):
    for name, page in pages.items():
        levels = page.headings
        assert levels.count(1) == 1, name
        assert levels[0] == 1, name
        assert all(after <= before + 1 for before, after in pairwise(levels)), name


def test_search_knows_the_pages_without_a_server(site):
    index = json.loads((site / "search" / "search_index.js").read_text().removeprefix("var __index = "))
    found = {
        entry["location"].split("#")[0]
        for entry in index["docs"]
        if "heat kernel" in f"{entry['title']} {entry['text']}".lower()
    }
    assert {"features.html", "faq.html", "api.html"} <= found


def test_help_of_every_command_is_on_a_page(site):
    text = (site / "help.html").read_text()
    for verb in VERBS:
        assert f'id="meshshard-{verb}"' in text


def test_what_others_may_import_is_on_a_page(site):
    text = (site / "api.html").read_text()
    for name in ("open_dataset", "Sample", "compute_features", "TaskDrivenNet", "ShardGraphs"):
        assert re.search(rf'id="[\w.]+\.{name}"', text), name


def of_every_kind(pages):
    """Names of some pages that have elements of every kind that any page has."""
    names, left = [], set().union(*(page.kinds for page in pages.values()))
    while left:
        names.append(max(pages, key=lambda name: len(pages[name].kinds & left)))
        left -= pages[names[-1]].kinds
    return names


@pytest.mark.soak
@pytest.mark.browser
def test_nothing_keeps_anybody_out_of_any_page(browser, address, pages):
    """In the short form, of pages that have elements of every kind: how they look and work is decided by that."""
    names = sorted(pages) if SOAKING else of_every_kind(pages)
    assert 5 < len(names) <= len(pages)
    window = browser.new_page()
    found = []
    for name in names:
        window.goto(f"{address}/{name}")
        for scheme, called, rules in (("light", "default", ()), ("dark", "slate", ("color-contrast",))):
            window.emulate_media(color_scheme=scheme)
            window.wait_for_selector(f"body[data-md-color-scheme={called}]")
            found += [f"{scheme}: {finding}" for finding in findings(window, rules)]
    window.close()
    assert found == []
