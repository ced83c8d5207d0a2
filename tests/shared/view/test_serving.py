"""Where the page answers, and what is said where it cannot."""

import re
import socket
import urllib.request
from dataclasses import replace

import pytest
from samples import sample, write_dataset

from meshshard import Dataset, UsageError, open_dataset
from meshshard.index import Rejection
from meshshard.view import serving
from meshshard.view.page import Page


@pytest.fixture
def taken():
    with socket.create_server(("127.0.0.1", 0)) as server:
        yield server.getsockname()[1]


def test_a_port_that_is_taken_is_named_with_what_to_type(taken):
    message = (
        f"port {taken} of 127.0.0.1 is taken, by another `meshshard view` perhaps: choose another one with --port"
    )
    with pytest.raises(UsageError, match=re.escape(message)):
        serving.check_address("127.0.0.1", taken)


def test_an_address_of_another_machine_is_refused():
    with pytest.raises(UsageError, match=re.escape("192.0.2.1, port 0: nobody can listen there (Cannot assign")):
        serving.check_address("192.0.2.1", 0)


def test_a_data_set_without_meshes_is_refused(tmp_path):
    dataset = open_dataset(write_dataset(tmp_path, [sample(1)], [""]))
    refused = Rejection(id="a", source="a.obj", code="no-faces", message="a.obj: no faces", key="")
    none = {"shards": (), "ids": (), "keys": (), "splits": (), "refused": (refused,)}
    dataset = Dataset(dataset.folder, replace(dataset.index, **none))
    with pytest.raises(UsageError, match=r"toy has no mesh to look at; a.obj: no faces"):
        serving.serve(dataset, None, "127.0.0.1", 0, False)


def test_it_says_where_it_answers_and_how_over_ssh_and_reads_nothing_before(tmp_path, monkeypatch, capsys):
    dataset, opened = open_dataset(write_dataset(tmp_path, [sample(1)], ["train"])), []
    (tmp_path / "shard-0.h5").unlink()

    def work(_):
        with urllib.request.urlopen(opened[0]) as answer:
            opened.append(answer.status)
        raise KeyboardInterrupt

    monkeypatch.setenv("SSH_CONNECTION", "somewhere")
    monkeypatch.setattr(serving.webbrowser, "open", opened.append)
    monkeypatch.setattr(Page, "work", work)
    serving.serve(dataset, None, "127.0.0.1", 0, True)
    url, status = opened
    port = url.rsplit(":")[-1]
    assert (url, status) == (f"http://127.0.0.1:{port}", 200)
    first, second = capsys.readouterr().out.splitlines()
    assert first == f"toy, 1 meshes: {url} (Ctrl-C ends it)"
    assert f"ssh -L {port}:127.0.0.1:{port} " in second
    serving.check_address("127.0.0.1", int(port))  # it is free again


def test_nobody_can_make_it_ask_visers_relay_for_an_address():
    server = serving.Server("127.0.0.1", 0, verbose=False)
    assert server.request_share_url() is None
    server.stop()
