"""Work in pieces: in this process while it is little; a cluster that can't be used is one sentence."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest
from refusals import refuses

from workbench.base import parallel
from workbench.base.errors import OptionError
from workbench.base.progress import Cancelled, running

WORK = """
import time
def slowly(number):
    time.sleep(0.3)
    return number
"""


def test_little_work_starts_no_other_process_and_much_does(monkeypatch):
    """Their start takes seconds, in which a plate is tried on a thousand arms."""
    assert parallel.spread(os.getpid, [()] * 8) == [os.getpid()] * 8
    monkeypatch.setattr(parallel, "MIN_PIECES", 2)
    assert os.getpid() not in parallel.spread(os.getpid, [()] * 8)
    assert parallel.spread(divmod, [(n, 3) for n in range(8)]) == [divmod(n, 3) for n in range(8)]


def test_work_ends_after_the_piece_in_which_it_is_asked_to():
    done = []
    with pytest.raises(Cancelled), running(cancel=lambda: len(done) == 2):
        parallel.spread(done.append, [(k,) for k in range(5)])
    assert done == [0, 1]


def test_nobody_at_the_address(monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr(parallel, "CONNECTION_TIMEOUT", 0.3)
    with refuses(OptionError, option="--scheduler", found="tcp://127.0.0.1:9"):
        parallel.spread(len, [([],)], scheduler="tcp://127.0.0.1:9")


@pytest.fixture
def cluster(tmp_path, monkeypatch):
    """A scheduler and a worker in processes of their own: the scheduler's address, and both processes."""
    pytest.importorskip("distributed")
    (tmp_path / "spread_work.py").write_text(WORK)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(parallel, "CONNECTION_TIMEOUT", 60.0)
    address_file = tmp_path / "scheduler.json"
    environment = os.environ | {"PYTHONPATH": f"{Path(parallel.__file__).resolve().parents[2]}:{tmp_path}"}
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "env": environment, "cwd": tmp_path}
    dask = [sys.executable, "-m", "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0"]
    scheduler = subprocess.Popen([*dask, "--no-dashboard", "--scheduler-file", address_file], **quiet)
    work = [sys.executable, "-m", "distributed.cli.dask_worker", "--scheduler-file", address_file]
    worker = subprocess.Popen([*work, "--nthreads", "2", "--no-dashboard"], **quiet)
    while not address_file.exists() or not address_file.read_text().strip():
        time.sleep(0.1)
    yield json.loads(address_file.read_text())["address"], scheduler, worker
    for process in (worker, scheduler):
        process.kill()
        process.wait()


@pytest.mark.slow
def test_a_cluster_without_workers_is_said(cluster, monkeypatch):
    import spread_work

    address, _, worker = cluster
    assert parallel.spread(spread_work.slowly, [(k,) for k in range(4)], scheduler=address) == [*range(4)]
    worker.kill()
    worker.wait()
    monkeypatch.setattr(parallel, "CONNECTION_TIMEOUT", 1.0)
    with pytest.raises(OptionError, match="can't be used"):
        parallel.spread(spread_work.slowly, [(k,) for k in range(4)], scheduler=address)


@pytest.mark.slow
def test_a_scheduler_that_is_lost_is_said(cluster):
    import spread_work

    address, scheduler, _ = cluster
    with pytest.raises(OptionError, match="can't be used"), running(lambda share, text: scheduler.kill()):
        parallel.spread(spread_work.slowly, [(k,) for k in range(100)], scheduler=address)
