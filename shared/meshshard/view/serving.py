"""From a data set to a page that answers at an address."""

import contextlib
import errno
import io
import os
import socket
import webbrowser

import typer
import viser

from meshshard.dataset import Dataset
from meshshard.errors import UsageError
from meshshard.view.opinion import Judge
from meshshard.view.page import Page


class Server(viser.ViserServer):
    """Never asks viser's public relay for an address, which a browser could otherwise tell it to."""

    def request_share_url(self, verbose: bool = True) -> str | None:  # noqa: ARG002  viser's signature
        """None: what is shown stays on this machine."""
        return None


def serve(dataset: Dataset, judge: Judge | None, host: str, port: int, open_page: bool) -> None:
    """Show a data set until somebody presses Ctrl-C. `port` 0: any that is free. UsageError: the data set has no
    meshes, or nobody can listen there."""
    if not len(dataset):
        why = [entry.message for entry in (*dataset.index.refused, *dataset.index.failed)]
        raise UsageError("; ".join([f"{dataset.name} has no mesh to look at", *why[:1]]))
    check_address(host, port)
    with contextlib.redirect_stdout(io.StringIO()):  # viser prints a table
        server = Server(host, port, verbose=False)
    page, url = Page(server, dataset, judge), f"http://{host}:{server.get_port()}"
    typer.echo(f"{dataset.name}, {len(dataset):,} meshes: {url} (Ctrl-C ends it)")
    if os.environ.get("SSH_CONNECTION"):
        there = f"{server.get_port()}:{host}:{server.get_port()}"
        typer.echo(f"on your own machine type: ssh -L {there} {socket.gethostname()}, then open the address there")
    if open_page:
        webbrowser.open(url)
    try:
        with contextlib.suppress(KeyboardInterrupt):
            page.work()
    finally:
        with contextlib.redirect_stdout(io.StringIO()):
            server.stop()


def check_address(host: str, port: int) -> None:
    """UsageError: nobody can listen there; viser would take another port, or wait for ever."""
    try:
        family = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0][0]
        socket.create_server((host, port), family=family).close()
    except OSError as error:
        if error.errno == errno.EADDRINUSE:
            raise UsageError(
                f"port {port} of {host} is taken, by another `meshshard view` perhaps: choose another one with "
                "--port N, or --port 0 for any that is free"
            ) from error
        why = str(error.strerror).partition(" (")[0]
        raise UsageError(
            f"{host}, port {port}: nobody can listen there ({why}); --host is an address of this machine, and --port "
            "mostly 1024 or more"
        ) from error
