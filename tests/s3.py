"""An S3 of this machine's own, for tests of URLs."""

import logging
import socket
import threading
from contextlib import closing, contextmanager, suppress

import fsspec
from moto.server import ThreadedMotoServer
from s3fs import S3FileSystem

ENVIRONMENT = {
    "AWS_ACCESS_KEY_ID": "nobody",
    "AWS_SECRET_ACCESS_KEY": "nothing",
    "AWS_DEFAULT_REGION": "us-east-1",
    "AWS_EC2_METADATA_DISABLED": "true",
    "AWS_CONFIG_FILE": "/dev/null",
    "AWS_SHARED_CREDENTIALS_FILE": "/dev/null",
    "AWS_MAX_ATTEMPTS": "1",
    "NO_PROXY": "127.0.0.1",
}


class S3:
    """A server, which this process and those that it starts see as s3://bucket. `requests`: what it was asked, as
    "GET /bucket/name"."""

    def __init__(self, address, requests, patch):
        self.address, self.requests, self.patch = address, requests, patch
        for name, value in ENVIRONMENT.items():
            patch.setenv(name, value)
        patch.setattr(S3FileSystem, "retries", 2)
        self.point_to(address)
        self.files.makedirs("bucket", exist_ok=True)

    @property
    def files(self):
        return fsspec.filesystem("s3")

    def point_to(self, address):
        self.patch.setenv("AWS_ENDPOINT_URL", "http://{}:{}".format(*address))
        S3FileSystem.clear_instance_cache()

    def put(self, folder, name):
        """Copy a folder to s3://bucket/NAME, and give that URL."""
        self.files.pipe(
            {f"bucket/{name}/{p.relative_to(folder)}": p.read_bytes() for p in folder.rglob("*") if p.is_file()}
        )
        return f"s3://bucket/{name}"

    def asked_for(self, words):
        return [request for request in self.requests if words in request]


@contextmanager
def cut_after(address, size):
    """The address of a relay to a server that hangs up after `size` bytes of every answer."""

    def relay(client):
        with client, closing(socket.create_connection(address)) as server, suppress(OSError):
            server.settimeout(0.2)
            server.sendall(client.recv(65536))
            left = size
            while left > 0 and (data := server.recv(min(left, 65536))):
                client.sendall(data)
                left -= len(data)

    def serve(listener):
        with suppress(OSError):
            while True:
                threading.Thread(target=relay, args=(listener.accept()[0],), daemon=True).start()

    with closing(socket.create_server(("127.0.0.1", 0))) as listener:
        threading.Thread(target=serve, args=(listener,), daemon=True).start()
        yield listener.getsockname()
        listener.shutdown(socket.SHUT_RDWR)


@contextmanager
def moto_server(port=0):
    """A server on a port of this machine, 0 for any: its address, and the list of requests that grows."""
    requests = []
    log = logging.Handler()
    log.emit = lambda record: requests.append(str(record.args[0]))
    logging.getLogger("werkzeug").addHandler(log)
    server = ThreadedMotoServer("127.0.0.1", port, verbose=False)
    server.start()
    yield server.get_host_and_port(), requests
    server.stop()
    logging.getLogger("werkzeug").removeHandler(log)
    S3FileSystem.clear_instance_cache()
