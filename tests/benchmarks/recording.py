"""What recording costs, how large and how quick long sessions are, and what a kill leaves.

    python tests/benchmarks/recording.py cost | long | drags [DRAGS] | kill [TIMES]

`cost`: what journal and pictures cost the worker at every place of a drag. `long`: 10 000 places of a
drag in a hundred drags: size of the folder, time to read the pictures, time to come to the session again.
`drags`: the same for 10 000 whole drags of a grab, a place and a drop, one every two seconds of the
session's clock; a hundred are done, and recorded again and again; pictures go to the file as by that clock.
`kill`: a scripted session is killed at random moments; every recording must open, the journal must have all
but the last command, and a replay must come to the same numbers.
"""

import itertools
import os
import random
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from workbench.design.plate_toml import load_plate
from workbench.record.blueprint import blueprint
from workbench.record.canvas import Canvas
from workbench.record.drawing import INTERVAL, Drawing
from workbench.record.entities import Moment
from workbench.record.outlet import FILE_TICK, FileOutlet
from workbench.record.review import pictures_of
from workbench.record.start import recorder
from workbench.robots import load_robot
from workbench.session import Worker
from workbench.session.commands import DropTarget, GrabTarget, MoveTarget
from workbench.session.journal.check import check
from workbench.session.journal.folder import begin
from workbench.session.journal.reader import read_recording
from workbench.session.journal.restore import restore
from workbench.session.keeper import AbstractKeeper

LONG, PER_DRAG, STEPS = 10_000, 100, 300
WRITER = """
import itertools, sys, time
from pathlib import Path
from tests.benchmarks.recording import recorded, places
worker = recorded(Path(sys.argv[1]))
print("go", flush=True)
for command in itertools.chain.from_iterable(places(worker.session, 100) for _ in itertools.count()):
    worker.submit(command)
    worker.wait()
    print(len(worker.journal), flush=True)
    time.sleep(0.003)
"""


def recorded(folder):
    """A worker whose session is recorded as `serve` does it."""
    begun = begin(load_robot("aria"), load_plate("table2"), folder=folder)
    return Worker(begun.session, keepers=(*begun.keepers, recorder(folder)))


def places(session, count, target=0, turn=0.0):
    """One drag along a small loop, which begins at an angle [rad]."""
    start = session.first_plate.targets[target]
    yield GrabTarget(target, 1)
    for angle in turn + np.linspace(0.0, 2.0 * np.pi, count + 1)[:count]:
        xyz = start.xyz + 0.04 * np.array([np.cos(angle) - 1.0, np.sin(angle), 0.5 * np.sin(2.0 * angle)])
        yield MoveTarget(target, tuple(xyz.tolist()), tuple(start.rpy.tolist()), 1)
    yield DropTarget(1)


class Timed(AbstractKeeper):
    """A keeper whose time in the worker's thread is noted: processor time, as other programs run too."""

    def __init__(self, keeper):
        self.keeper, self.times = keeper, []

    def begin(self, session, *, step, at, tell):
        self.keeper.begin(session, step=step, at=at, tell=tell)

    def note(self, step, entry, session):
        begin_ = time.thread_time()
        self.keeper.note(step, entry, session)
        self.times.append(1e3 * (time.thread_time() - begin_))

    def close(self):
        self.keeper.close()


def cost(room):
    """What every place of a drag costs the worker."""
    begun = begin(load_robot("aria"), load_plate("table2"), folder=room / "cost")
    journal, pictures = (Timed(keeper) for keeper in (*begun.keepers, recorder(room / "cost")))
    worker = Worker(begun.session, keepers=(journal, pictures))
    for command in places(worker.session, STEPS):
        worker.submit(command)
        worker.wait()
    worker.close()
    for name, keeper in (("journal", journal), ("pictures", pictures)):
        median, most = statistics.median(keeper.times), np.percentile(keeper.times, 95)
        print(f"{name:<9} median {median:.3f} ms   p95 {most:.3f} ms")


def long(room):
    """Ten thousand places."""
    worker = recorded(room / "long")
    for k in range(LONG // PER_DRAG):
        for command in places(worker.session, PER_DRAG, target=k % 10):
            worker.submit(command)
            worker.wait()
    worker.close()
    recording = reopen(room / "long", room)
    begin_ = time.perf_counter()
    again = restore(recording)
    print(f"session opened  {time.perf_counter() - begin_:6.2f} s")
    assert again.score.indices == worker.session.score.indices


def reopen(folder, room):
    """How large a recording is, and how long it takes to open it."""
    for path in sorted(folder.glob("*.*")):
        print(f"{path.name:<15} {path.stat().st_size / 2**20:6.2f} MiB")
    begin_ = time.perf_counter()
    (room / "mended").mkdir()
    recording = read_recording(folder)
    print(f"journal read    {time.perf_counter() - begin_:6.2f} s, {len(recording.lines)} steps")
    begin_ = time.perf_counter()
    files = pictures_of(recording, room / "mended")
    print(f"pictures read   {time.perf_counter() - begin_:6.2f} s, {[f.name for f in files]}", flush=True)
    return recording


class Slowly(AbstractKeeper):
    """Draws at once what would be drawn at a drag every two seconds, batch by batch as then.

    Args:
        folder: Of the recording.
    """

    PAUSE = 2.0

    def __init__(self, folder):
        self.folder, self.at, self.handed_on = folder, 0.0, 0.0

    def begin(self, session, *, step, at, tell):
        self.outlet = FileOutlet(
            self.folder / "session.rrd", "slowly", blueprint=blueprint(session), tell=tell
        )
        self.drawing = Drawing(Canvas([self.outlet]))
        self.drawing.draw(Moment(step, at, session))

    def note(self, step, entry, session):
        self.at += self.PAUSE if isinstance(entry.command, GrabTarget) else INTERVAL
        self.drawing.draw(Moment(step, self.at, session, entry))
        if self.at - self.handed_on >= FILE_TICK:
            self.handed_on = self.at
            self.outlet.stream.flush()

    def close(self):
        self.outlet.close()


class Seen(AbstractKeeper):
    """Remembers every step, and how the session began."""

    def __init__(self):
        self.first, self.steps = None, []

    def begin(self, session, *, step, at, tell):
        self.first = session

    def note(self, step, entry, session):
        self.steps.append((entry, session))

    def close(self):
        pass


def drags(room, count):
    """Whole drags: some are done, and recorded again and again."""
    folder = room / "drags"
    begun, seen = begin(load_robot("aria"), load_plate("table2"), folder=folder), Seen()
    worker = Worker(begun.session, keepers=(seen,))
    for k in range(min(count, PER_DRAG)):
        for command in places(worker.session, 1, target=k % 10, turn=k):
            worker.submit(command)
            worker.wait()
    worker.close()
    keepers = (*begun.keepers, Slowly(folder))
    for keeper in keepers:
        keeper.begin(seen.first, step=0, at=0.0, tell=print)
    again = itertools.islice(itertools.cycle(seen.steps), 3 * count)
    for step, (entry, session) in enumerate(again, start=1):
        for keeper in keepers:
            keeper.note(step, replace(entry, basis=step - 1), session)
    for keeper in keepers:
        keeper.close()
    reopen(folder, room)


def kill(room, times):
    """Kills at random moments."""
    environment = os.environ | {"PYTHONPATH": str(Path(__file__).resolve().parents[2])}
    rng = random.Random(1)
    for k in range(times):
        folder = room / f"killed{k}"
        process = subprocess.Popen(
            [sys.executable, "-c", WRITER, folder], stdout=subprocess.PIPE, text=True, env=environment
        )
        process.stdout.readline()
        time.sleep(rng.uniform(0.0, 3.0))
        os.kill(process.pid, signal.SIGKILL)
        said = [int(line) for line in process.stdout.read().splitlines(keepends=True) if line.endswith("\n")]
        process.wait()
        done = said[-1] if said else 0
        recording = read_recording(folder)
        room_ = room / f"mended{k}"
        room_.mkdir()
        notes = []
        files = pictures_of(recording, room_, say=notes.append)
        replayed = check(recording)
        assert done <= len(recording.lines) <= done + 1, (done, len(recording.lines))
        assert not replayed.differences
        drawn = "from the journal" if any(f.name == "drawn.rrd" for f in files) else files[0].name
        print(f"{k + 1:3}: {done} done, {len(recording.lines)} in the journal, pictures: {drawn}", flush=True)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        if sys.argv[1] == "kill":
            kill(Path(folder), int(sys.argv[2]) if len(sys.argv) > 2 else 20)
        elif sys.argv[1] == "drags":
            drags(Path(folder), int(sys.argv[2]) if len(sys.argv) > 2 else LONG)
        else:
            {"cost": cost, "long": long}[sys.argv[1]](Path(folder))
