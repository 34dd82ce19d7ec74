"""Writing: whole or not at all, links followed, devices written into, a full disk in one sentence."""

import os
import stat
import threading
import tracemalloc

import pytest
from refusals import refuses

from workbench.base import files
from workbench.base.errors import FileError


def test_a_link_stays_a_link(tmp_path):
    (tmp_path / "link").symlink_to("target")
    files.check_writable(tmp_path / "link")
    for content in (b"first", b"second"):
        files.write_bytes(tmp_path / "link", content)
        assert (tmp_path / "link").is_symlink()
        assert (tmp_path / "target").read_bytes() == content


def test_a_pipe_is_written_into(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    read: list[bytes] = []
    reader = threading.Thread(target=lambda: read.append((tmp_path / "pipe").read_bytes()))
    reader.start()
    files.check_writable(tmp_path / "pipe")
    files.write_bytes(tmp_path / "pipe", b"result")
    reader.join(60.0)
    assert read == [b"result"]
    assert stat.S_ISFIFO((tmp_path / "pipe").stat().st_mode)


@pytest.mark.parametrize("name", ["-", "/dev/stdout"])
def test_standard_output(name, tmp_path, monkeypatch, capfdbinary):
    monkeypatch.chdir(tmp_path)
    files.check_writable(name)
    files.write_bytes(name, b"result")
    assert capfdbinary.readouterr().out == b"result"
    assert not list(tmp_path.iterdir())


def test_a_small_file_takes_little_memory(tmp_path):
    (tmp_path / "small.csv").write_bytes(b"q1[deg]")
    tracemalloc.start()
    files.read_bytes(tmp_path / "small.csv", wanted="a measurement file")
    assert tracemalloc.get_traced_memory()[1] < 2 * files.CHUNK_BYTES
    tracemalloc.stop()


def test_a_device_without_end_is_refused():
    with refuses(FileError, "1 MiB", path="/dev/zero"):
        files.read_bytes("/dev/zero", wanted="a measurement file", maximum=2**20)
