"""A real arm's live source: the scene follows it, guided measuring takes its rows from it."""

import json
import socket
import threading
from contextlib import contextmanager
from dataclasses import replace
from time import monotonic, sleep

import numpy as np

from workbench import Motion, measure_plate, tool_poses
from workbench.extras.live.connection import connect, lines_from
from workbench.extras.live.sample import Sample
from workbench.extras.live.session import MeasureLive, Measuring, Source, TakeSample, UseRows
from workbench.extras.live.sources import LiveSource
from workbench.session import Worker, replay, start
from workbench.session.page_state import Severity
from workbench.session.state import Focus

Q = (0.1, 0.9, 1.2, 0.3, 0.4, 0.5)
STEPS = (*np.linspace(0.2, 1.0, 5), *[1.0] * 6)
"""Shares of the way to a target, and how long the arm stands there."""


def until(worker, holds):
    """The session once something is true of it."""
    end = monotonic() + 60.0
    while not holds(worker.session):
        assert monotonic() < end, "it did not happen"
        sleep(0.01)
    return worker.session


def line(q, time, **more):
    return json.dumps(Sample(time=time, q=np.array(q), **more).plain()) + "\n"


def visits(actual, targets):
    """Samples of an arm that goes from target to target, stands there, and asks for the last to be kept."""
    path = [
        s * b + (1.0 - s) * a
        for a, b in zip([0.0 * targets[0], *targets], targets, strict=False)
        for s in STEPS
    ]
    poses = tool_poses(actual, Motion(np.stack(path)))
    for k, (q, pose) in enumerate(zip(path, poses, strict=True)):
        is_last = k % len(STEPS) == len(STEPS) - 1
        yield Sample(time=0.1 * k, q=q, position=pose[:3, 3], rotation=pose[:3, :3], capture=is_last)


def test_an_arm_on_a_socket_is_followed_and_measured(first):
    """The simulated sender on loopback; a busy machine makes it wait, and passes no target."""
    plate = replace(first.plate, targets=first.plate.targets[:3])
    actual, rows = measure_plate(first.robot, plate, instrument="ideal", seed=4)
    samples = list(visits(actual, rows.q))
    worker = Worker(start(first.robot, plate))
    begun = threading.Event()

    def is_taken(sample):
        return lambda s: (last := s.part(Measuring).acquisition.latest) and last.time == sample.time

    def send():
        with server, server.accept()[0] as connection:
            begun.wait(60.0)
            for sample in samples:
                connection.sendall((json.dumps(sample.plain()) + "\n").encode())
                until(worker, is_taken(sample))

    server = socket.create_server(("127.0.0.1", 0))
    threading.Thread(target=send, daemon=True).start()
    address = f"127.0.0.1:{server.getsockname()[1]}"
    try:
        with connect(address) as source:
            worker.add_view(LiveSource(worker, source, name=address))
            until(worker, lambda s: s.part(Source) is not None)
            worker.submit(MeasureLive())
            until(worker, lambda s: s.part(Measuring) is not None)
            begun.set()
            until(worker, lambda s: s.playback.focus is Focus.JOG and s.playback.jogged is not None)
            session = until(worker, lambda s: not s.part(Source).is_open)
            assert worker.wait()
        assert len(session.part(Measuring).acquisition.rows) == 3
        worker.submit(UseRows())
        assert worker.wait()
        session = worker.session
        data = session.measurements.loaded.dataset
        assert not session.measurements.loaded.virtual
        seen = np.linalg.norm(data.position - tool_poses(actual, Motion(data.q))[:, :3, 3], axis=1)
        assert seen.max() < 5e-4
        wanted = first.robot.base.pose @ plate.poses
        assert np.linalg.norm(data.position - wanted[:, :3, 3], axis=1).max() < 3e-3
        again = replay(start(first.robot, plate), worker.journal)
        assert np.array_equal(again.measurements.loaded.dataset.q, data.q)
    finally:
        worker.close()


@contextmanager
def harmful(worker):
    """A source at a socket that sends what it likes."""
    ours, theirs = socket.socketpair()
    with theirs, theirs.makefile("wb") as sent, lines_from(ours) as lines:
        worker.add_view(LiveSource(worker, lines, name="arm"))
        until(worker, lambda s: s.part(Source) is not None and s.part(Source).is_open)

        def send(*parts):
            for part in parts:
                sent.write(part if isinstance(part, bytes) else part.encode())
            sent.flush()

        yield send


def test_harmful_lines_leave_the_session_quick_and_the_arm_followed(worker):
    with harmful(worker) as send:
        whole = line(Q, 0.5)
        send(whole[:20])
        sleep(0.1)
        send(whole[20:], b"x" * 10_000_000 + b"\n", b"\xff\x00\n", "[" * 60_000 + "\n")
        send('{"time": NaN, "q": [NaN]}\n', line(Q[:4], 0.6), line(np.add(Q, 0.3), 0.7))
        session = until(
            worker, lambda s: s.playback.jogged is not None and np.allclose(s.playback.jogged, np.add(Q, 0.3))
        )
        assert [m.text for m in session.page.messages if m.severity is Severity.ERROR][1:] == []
        begin = monotonic()
        for first in (1.0, 30.0):
            for k in range(8):
                many = (line(np.add(Q, 1e-3 * k), first + k + 1e-4 * i, capture=True) for i in range(500))
                send(*many)
            if first == 1.0:
                worker.submit(MeasureLive())
                until(worker, lambda s: s.part(Measuring) is not None)
        taken = [e for e in worker.journal if isinstance(e.command, TakeSample)]
        assert len(taken) < 100 + 100 * (monotonic() - begin)
        assert worker.wait(60.0)
    until(worker, lambda s: not s.part(Source).is_open)
    with harmful(worker) as send:
        send(line(Q, 60.0))
        until(worker, lambda s: np.allclose(s.playback.jogged, Q))
