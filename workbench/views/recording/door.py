"""Recordings served to the rerun viewer in the browser, through a door of our own.

rerun's own server gives a recording to whoever asks, a foreign page that has rebound its name included. Here
a recording has a secret in its path, and a request must name this server as its host.
"""

import contextlib
import secrets
import shutil
import threading
from collections.abc import Iterator, Mapping, Sequence
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

ADDRESS = "127.0.0.1"


class Door(ThreadingHTTPServer):
    """Serves some files, each under a path that nobody can guess.

    Args:
        files: Which.
    """

    daemon_threads = True

    def __init__(self, files: Sequence[Path]):
        super().__init__((ADDRESS, 0), _Request)
        secret = secrets.token_urlsafe(16)
        self.host = f"{ADDRESS}:{self.server_port}"
        self.files: Mapping[str, Path] = {f"/{secret}/{i}/{path.name}": path for i, path in enumerate(files)}

    @property
    def links(self) -> list[str]:
        """Address of each file."""
        return [f"http://{self.host}{path}" for path in self.files]


class _Request(BaseHTTPRequestHandler):
    """One request."""

    server: Door

    def do_GET(self) -> None:
        """Send the file; any page may read it that knows the path."""
        path = self.server.files.get(self.path)
        if path is None or self.headers.get_all("Host") != [self.server.host]:
            self.send_error(403)
            return
        with path.open("rb") as file, contextlib.suppress(ConnectionError):
            self.send_response(200)
            self.send_header("Content-Type", "application/octet-stream")
            self.send_header("Content-Length", str(path.stat().st_size))
            self.send_header("Access-Control-Allow-Origin", "*")
            self.send_header("Cache-Control", "no-store")
            self.end_headers()
            shutil.copyfileobj(file, self.wfile)

    def log_message(self, format: str, *args: object) -> None:
        """Say nothing."""


@contextlib.contextmanager
def opened(files: Sequence[Path]) -> Iterator[list[str]]:
    """Addresses of the files, while they are served."""
    with Door(files) as door:
        threading.Thread(target=door.serve_forever, name="workbench-door", daemon=True).start()
        try:
            yield door.links
        finally:
            door.shutdown()
