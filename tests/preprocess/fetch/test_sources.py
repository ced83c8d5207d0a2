"""The addresses as data: well formed, with a place where they were read. None is opened."""

import re
from pathlib import PurePosixPath
from urllib.parse import urlsplit

import pytest

from meshshard_prep.datasets import ADAPTERS
from meshshard_prep.fetch.sources import SOURCES, source_of


@pytest.mark.parametrize("name", SOURCES)
def test_a_source_is_complete(name):
    source = SOURCES[name]
    assert re.fullmatch(r"https?://\S+", source.page)
    assert re.match(r"github\.com/[\w.-]+/[\w.-]+: \S+", source.read_in)
    assert source.archives or source.by_hand
    files = [archive.file for archive in source.archives]
    assert len(set(files)) == len(files)
    for archive in source.archives:
        assert archive.url or source.by_hand
        assert re.fullmatch(r"[\w.-]+\.(zip|tar\.gz)", archive.file)
        assert re.fullmatch(r"([0-9a-f]{64})?", archive.sha256)
        assert archive.holds
        assert not PurePosixPath(archive.into).is_absolute()
        if archive.url:
            assert urlsplit(archive.url).scheme in ("http", "https")
            assert urlsplit(archive.url).hostname
    folders = [(archive.into, archive.holds) for archive in source.archives]
    assert len(set(folders)) == len(folders)


def test_sentences_about_what_to_do_go_on_from_the_page():
    """They stand after "open PAGE, " and before ", and type"."""
    for source in SOURCES.values():
        assert not source.by_hand or source.by_hand[0].islower()
        assert not source.by_hand.endswith((".", ","))


def test_what_is_generated_is_not_fetched():
    assert [name for name, adapter in ADAPTERS.items() if adapter.generate and source_of(adapter)] == []


def test_every_source_is_of_a_known_data_set():
    assert set(SOURCES) <= {adapter.folder or adapter.name for adapter in ADAPTERS.values()}
