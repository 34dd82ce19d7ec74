"""The viewer itself, without a window: a session streams to it while it goes on."""

import contextlib
import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

from workbench.session import Worker
from workbench.session.commands.drag import SelectTarget
from workbench.views.recording.recorder import recorder

os.environ.setdefault("RERUN_ANALYTICS_ENABLED", "false")
pytestmark = pytest.mark.browser
PATIENCE = 60.0


@pytest.fixture
def viewer():
    """A viewer that listens on the loopback address, and its port."""
    if not list(Path("/usr/share/vulkan/icd.d").glob("*.json")):
        if os.environ.get("CI", "").lower() == "true":
            pytest.fail("no Vulkan driver: install Debian's mesa-vulkan-drivers")
        pytest.skip("Debian's mesa-vulkan-drivers is not installed")
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    options = ["--headless", "--bind", "127.0.0.1", "--port", str(port), "--hide-welcome-screen"]
    program = [str(Path(sys.executable).with_name("rerun")), *options]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "start_new_session": True}
    process = subprocess.Popen(program, **quiet)
    try:
        yield _connect(port, process), port
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGTERM)
        process.wait(60)


def _connect(port: int, process: subprocess.Popen):
    from rerun.experimental import ViewerClient

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


def test_a_session_streams_to_an_open_viewer(viewer, sample):
    client, port = viewer
    worker = Worker(sample.first, keepers=[recorder(None, live=f"127.0.0.1:{port}")])
    for target in (3, 5, 7):
        worker.submit(SelectTarget(target))
    worker.wait()
    worker.close()
    deadline, ends = time.monotonic() + PATIENCE, []
    while 3 not in ends and time.monotonic() < deadline:
        recordings = [r for r in client.get_state().recordings if r.store_id.endswith(":session")]
        ends = [t.end for r in recordings for t in r.timelines if t.name == "step"]
        time.sleep(0.2)
    assert 3 in ends
