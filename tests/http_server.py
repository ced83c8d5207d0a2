"""A real HTTP server on this machine that answers as it is told: whole, slowly, cut short, with something else."""

import threading
import time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer


class Server:
    """`answers`: path -> functions that each answer one request; the last one answers all that follow.
    `requests`: path and headers of what was asked, in order."""

    def __init__(self):
        self.answers, self.requests = {}, []
        outer = self

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self):
                outer.requests.append((self.path, dict(self.headers)))
                answers = outer.answers[self.path]
                (answers.pop(0) if len(answers) > 1 else answers[0])(self)

            def log_message(self, *arguments):
                pass

        class Quiet(ThreadingHTTPServer):
            daemon_threads = True

            def handle_error(self, request, address):
                pass  # clients hang up on purpose

        self.server = Quiet(("127.0.0.1", 0), Handler)
        self.address = f"http://127.0.0.1:{self.server.server_port}"
        threading.Thread(target=self.server.serve_forever, kwargs={"poll_interval": 0.02}, daemon=True).start()

    def answer(self, path, *answers):
        """Set the answers of a path; gives its URL."""
        self.answers[path] = list(answers)
        return self.address + path

    def close(self):
        self.server.shutdown()
        self.server.server_close()


def content(data, *, tag='"1"', ranges=True, cut=None, length=True, kind="application/zip", pause=0.0, head=()):
    """Answer with `data`, from the byte that is asked for if `ranges`. `cut`: hang up after so many bytes. `pause`:
    seconds before every thousandth byte. `head`: more headers, which win."""

    def answer(handler):
        asked, still = handler.headers.get("Range", ""), handler.headers.get("If-Range")
        first = int(asked.removeprefix("bytes=").rstrip("-")) if ranges and asked and still == tag else 0
        headers = {"Content-Type": kind}
        if length:
            headers["Content-Length"] = str(len(data) - first)
        if tag:
            headers["ETag"] = tag
        if first:
            headers["Content-Range"] = f"bytes {first}-{len(data) - 1}/{len(data)}"
        handler.send_response(206 if first else 200)
        for name, value in (headers | dict(head)).items():
            handler.send_header(name, value)
        handler.end_headers()
        body = data[first:][:cut]
        for start in range(0, len(body), 1000):
            time.sleep(pause)
            handler.wfile.write(body[start : start + 1000])

    return answer


def status(code, **headers):
    """Answer with a status and nothing else."""

    def answer(handler):
        handler.send_response(code)
        for name, value in headers.items():
            handler.send_header(name, value)
        handler.send_header("Content-Length", "0")
        handler.end_headers()

    return answer
