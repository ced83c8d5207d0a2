"""No test here opens an address that is not on this machine."""

import socket

import pytest
from http_server import Server

from meshshard_prep.fetch import download

HERE = ("127.0.0.1", "::1", "localhost")


@pytest.fixture(autouse=True)
def only_this_machine(monkeypatch):
    """Fail at once where a socket is opened to another machine, or its name is looked up."""

    def guarded(call, host_of):
        def guard(*arguments, **options):
            host = host_of(arguments)
            assert host in HERE, f"a test wants to reach {host}"
            return call(*arguments, **options)

        return guard

    monkeypatch.setattr(socket.socket, "connect", guarded(socket.socket.connect, lambda a: a[1][0]))
    monkeypatch.setattr(socket, "getaddrinfo", guarded(socket.getaddrinfo, lambda a: a[0]))


@pytest.fixture
def server():
    running = Server()
    yield running
    running.close()


@pytest.fixture(autouse=True)
def no_pauses(monkeypatch):
    """Tries follow each other at once."""
    monkeypatch.setattr(download, "PAUSES", (0.0, 0.0, 0.0))
