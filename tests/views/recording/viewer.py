"""A real rerun viewer without a window, for pictures."""

import contextlib
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

os.environ.setdefault("RERUN_ANALYTICS_ENABLED", "false")
from rerun.experimental import ViewerClient

PATIENCE = 60.0


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@contextlib.contextmanager
def viewer(size: str = "1600x1000") -> Iterator[tuple[ViewerClient, int]]:
    """A viewer that listens on the loopback address, and its port."""
    port = free_port()
    options = ["--headless", "--bind", "127.0.0.1", "--port", str(port), "--hide-welcome-screen"]
    program = [str(Path(sys.executable).with_name("rerun")), *options, "--window-size", size]
    process = subprocess.Popen(
        program, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True
    )
    try:
        yield _connect(port, process), port
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGTERM)
        process.wait(60)


def picture(client: ViewerClient, path: Path) -> bytes:
    """Open a recording and take a picture, as it opens."""
    client.open(str(path.resolve()))
    deadline = time.monotonic() + PATIENCE
    while client.get_state().loading and time.monotonic() < deadline:
        time.sleep(0.2)
    time.sleep(1.0)
    shot, last = client.take_screenshot(), b""
    while shot != last and time.monotonic() < deadline:  # until nothing is drawn any more
        time.sleep(0.5)
        shot, last = client.take_screenshot(), shot
    return shot


def _connect(port: int, process: subprocess.Popen) -> ViewerClient:
    deadline = time.monotonic() + PATIENCE
    while True:
        try:
            client = ViewerClient.connect(f"rerun+http://127.0.0.1:{port}/proxy")
            client.get_state()
            return client
        except Exception:
            if time.monotonic() > deadline or process.poll() is not None:
                raise
            time.sleep(0.3)
