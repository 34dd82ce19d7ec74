"""The door of `review --web`: a recording only for who knows its path and names this server."""

import errno
import os
import signal
import time
import urllib.error
import urllib.request
from pathlib import Path

import pytest
from refusals import refuses

from workbench.base.errors import FileError
from workbench.extras.review import viewer
from workbench.extras.review.viewer import opened

SAMPLE = Path(__file__).resolve().parents[3] / "recordings" / "sample"


@pytest.fixture
def link(tmp_path):
    (tmp_path / "session.rrd").write_bytes(b"RRF2")
    with opened([tmp_path / "session.rrd"]) as links:
        yield links[0]


def get(address: str, **headers: str) -> bytes | int:
    try:
        with urllib.request.urlopen(urllib.request.Request(address, headers=headers), timeout=60) as answer:
            return answer.read()
    except urllib.error.HTTPError as error:
        return error.code


@pytest.mark.parametrize("host", ["evil.example", "localhost", "127.0.0.1:9090", ""])
def test_a_rebound_name_is_refused(link, host):
    assert get(link, Host=host) == 403


def test_a_recording_is_for_whoever_knows_its_path(link):
    assert get(link) == b"RRF2"
    start = link.split("/", 3)
    for path in ("session.rrd", "guess/0/session.rrd", "../session.rrd", ""):
        assert get("/".join([*start[:3], path])) == 403


def test_the_viewer_in_the_browser_is_given_addresses_and_ends_with_the_command(run, tmp_path, monkeypatch):
    """With addresses alone rerun opens no port of its own for data."""
    program, told, ended = (tmp_path / name for name in ("rerun", "told", "ended"))
    started = f"(trap 'echo > {ended}; exit' TERM; sleep 60 & wait) &"
    program.write_text(f'#!/bin/sh\necho "$@" > {told}\n{started}\nsleep 0.5\nkill -TERM $PPID\nwait\n')
    program.chmod(0o755)
    monkeypatch.setattr(viewer, "_program", lambda: str(program))
    assert run("review", SAMPLE, "--web")[0] == 0
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    assert told.read_text().startswith("--bind 127.0.0.1 --web-viewer http://127.0.0.1:")
    assert str(tmp_path) not in told.read_text()
    while not ended.exists():  # or else the test takes for ever
        time.sleep(0.05)


def test_a_disk_that_is_full_leaves_no_half_file(tmp_path, monkeypatch):
    def no_room(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    (tmp_path / "session.rrd").write_bytes(b"RRF2")
    monkeypatch.setattr("os.fsync", no_room)
    with refuses(FileError, path=str(tmp_path / "out.rrd")):
        viewer._join([tmp_path / "session.rrd"], tmp_path / "out.rrd", tmp_path)
    assert not (tmp_path / "out.rrd").exists()
