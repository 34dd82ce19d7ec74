"""Work on a Dask cluster: what is not as it should be is one sentence, and no piece is counted twice."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from workbench.base import parallel
from workbench.base.errors import OptionError
from workbench.base.progress import cancelled, running

ADDRESS = "tcp://127.0.0.1:1"


class Cluster:
    """Stands for a client whose workers give these answers."""

    def __init__(self, *found):
        self._found = found

    def wait_for_workers(self, count, timeout):
        if not self._found:
            raise TimeoutError

    def run(self, function):
        if isinstance(self._found[0], Exception):
            raise self._found[0]
        return {f"tcp://w{k}": parallel.versions() | found for k, found in enumerate(self._found)}


def test_little_work_starts_no_other_process():
    """Their start takes seconds, in which a plate is tried on a thousand arms."""
    assert parallel.spread(os.getpid, [()] * 8, workers=2) == [os.getpid()] * 8


def test_work_ends_after_a_piece_that_is_whole():
    """It would be another result than in a process of its own."""
    with running(cancel=lambda: True):
        assert parallel.spread(cancelled, [()] * 3, workers=1) == [False]


def test_workers_with_our_versions_are_taken():
    parallel._check_workers(Cluster({}, {}), ADDRESS)


@pytest.mark.parametrize(
    ("found", "text"),
    [
        ([{}, {"numpy": "1.0"}], r"the worker at tcp://w1 has numpy 1\.0 \(here .*install the same versions"),
        ([{"Python": "2.7", "workbench": "0"}], r"has workbench 0 \(here .*\), Python 2\.7 \(here"),
        ([], "has no workers; start some with `dask worker"),
        ([ModuleNotFoundError("workbench")], "can't import the workbench"),
    ],
)
def test_a_cluster_that_can_not_be_trusted_is_refused(found, text):
    with pytest.raises(OptionError, match=text):
        parallel._check_workers(Cluster(*found), ADDRESS)


WORK = """
import time
def slowly(number):
    time.sleep(0.3)
    return number
def hungrily(number):
    if number == 2:
        kept = [bytearray(50_000_000) for _ in range(100)]
        time.sleep(20)
    return number
"""


@pytest.fixture
def cluster(tmp_path, monkeypatch):
    """A scheduler and a worker in processes of their own: the scheduler's address and process."""
    pytest.importorskip("distributed")
    (tmp_path / "spread_work.py").write_text(WORK)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(parallel, "CONNECTION_TIMEOUT", 60.0)
    address_file = tmp_path / "scheduler.json"
    root = Path(parallel.__file__).resolve().parents[2]
    environment = os.environ | {"PYTHONPATH": f"{root}:{tmp_path}"}
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "env": environment, "cwd": tmp_path}
    dask = [sys.executable, "-m", "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0"]
    scheduler = subprocess.Popen([*dask, "--no-dashboard", "--scheduler-file", address_file], **quiet)
    worker = [
        sys.executable,
        "-m",
        "distributed.cli.dask_worker",
        "--scheduler-file",
        address_file,
        "--nthreads",
        "1",
    ]
    working = subprocess.Popen([*worker, "--no-dashboard", "--memory-limit", "600MB"], **quiet)
    while not address_file.exists() or not address_file.read_text().strip():
        time.sleep(0.1)
    yield json.loads(address_file.read_text())["address"], scheduler
    for process in (working, scheduler):
        process.kill()
        process.wait()


@pytest.mark.slow
def test_a_scheduler_that_is_lost_is_said(cluster):
    import spread_work

    address, scheduler = cluster
    with pytest.raises(OptionError, match="lost"), running(lambda share, text: scheduler.kill()):
        parallel.spread(spread_work.slowly, [(k,) for k in range(20)], scheduler=address)


@pytest.mark.slow
def test_a_piece_that_takes_all_memory_is_said_and_the_others_are_counted_once(cluster):
    import spread_work

    address, _ = cluster
    shares: list[float] = []
    with (
        pytest.raises(OptionError, match=r"4 .*--memory-limit"),
        running(lambda share, text: shares.append(share)),
    ):
        parallel.spread(spread_work.hungrily, [(k,) for k in range(4)], scheduler=address)
    assert shares == [0.25, 0.5]
