"""What recording costs, how large and how quick long sessions are, and what a kill leaves.

    python tests/benchmarks/recording.py cost | long | drags [DRAGS] | live [DRAGS] | kill [TIMES]

`cost`: the time of every place of a drag in a session that is recorded and in one that is not, turn by turn
in one process; and what journal and pictures take of the worker's processor time. `long`: 10 000 places of a
drag in a hundred drags: size of the folder, time to read journal and pictures, to come to the session again,
and for the viewer to load. `drags`: the same for 10 000 drags of twenty places in a second, one every two
seconds of the session's clock; a hundred are done, and recorded again and again as by that clock. `live`:
10 000 drags really done, as quickly as the worker takes them. `kill`: a scripted session is killed at random
moments; every recording must open, the journal must have all but the last command, and a replay must come to
the same numbers.
"""

import contextlib
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

from tests.views.recording.viewer import viewer
from workbench.arm.built_in_arms import load_robot
from workbench.plate.plate_toml import load_plate
from workbench.session import Worker
from workbench.session.commands.drag import DropTarget, GrabTarget, MoveTarget
from workbench.session.journal.compare_numbers import check
from workbench.session.journal.folder import begin
from workbench.session.journal.reader import read_recording
from workbench.session.journal.restore import restore
from workbench.session.view import AbstractKeeper
from workbench.views.recording.blueprint import blueprint
from workbench.views.recording.canvas import Canvas
from workbench.views.recording.draw_steps import Drawing, thinned
from workbench.views.recording.recorded_step import Moment
from workbench.views.recording.recorder import recorder
from workbench.views.recording.rerun_output import FILE_TICK, FileOutlet
from workbench.views.recording.review import pictures_of

LONG, PER_DRAG, PLACES = 10_000, 100, 20
STEPS, TURNS, GAP, PAUSE = 100, 6, 0.015, 1.0
WRITER = """
import sys, time
from pathlib import Path
from tests.benchmarks.recording import endless, recorded
worker = recorded(Path(sys.argv[1]))
print("go", flush=True)
for number, command in enumerate(endless(worker.session), start=1):
    worker.submit(command)
    worker.wait()
    print(number, flush=True)
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


def endless(session):
    """One drag after the other."""
    for turn in itertools.count():
        yield from places(session, PLACES, target=turn % 10, turn=turn)


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
    """What every place of a drag costs the user, and what of it the worker."""
    begun = begin(load_robot("aria"), load_plate("table2"), folder=room / "cost")
    journal, pictures = (Timed(keeper) for keeper in (*begun.keepers, recorder(room / "cost")))
    with_, without = Worker(begun.session, keepers=(journal, pictures)), Worker(begun.session)
    times = {with_: [], without: []}
    for turn in range(TURNS):
        for worker in (with_, without) if turn % 2 else (without, with_):
            times[worker] += timed(worker, places(worker.session, STEPS, turn=turn))
    for worker in times:
        worker.close()
    a, b = np.array(times[with_]), np.array(times[without])
    print(f"a place   recorded {np.median(a):.3f} ms, not recorded {np.median(b):.3f} ms, {len(a)} of each")
    print(f"          median of the differences {np.median(a - b):.3f} ms")
    for name, keeper in (("journal", journal), ("pictures", pictures)):
        median, most = statistics.median(keeper.times), np.percentile(keeper.times, 95)
        print(f"{name:<9} median {median:.3f} ms   p95 {most:.3f} ms of processor time")


def timed(worker, commands):
    """Time of every place from its command to the session after it [ms]; commands come as a hand moves."""
    found = []
    for command in commands:
        begin_ = time.perf_counter()
        worker.submit(command)
        worker.wait()
        if isinstance(command, MoveTarget):
            found.append(1e3 * (time.perf_counter() - begin_))
        time.sleep(GAP)
    time.sleep(0.5)  # the last pictures
    return found


def long(room):
    """Ten thousand places."""
    worker = recorded(room / "long")
    for k in range(LONG // PER_DRAG):
        do(worker, places(worker.session, PER_DRAG, target=k % 10))
    reopen(room / "long", room, worker)


def live(room, count):
    """Whole drags, really done."""
    worker = recorded(room / "live")
    for k in range(count):
        do(worker, places(worker.session, PLACES, target=k % 10, turn=k))
    reopen(room / "live", room, worker)


def do(worker, commands):
    """Carry commands out one after the other."""
    for command in commands:
        worker.submit(command)
        worker.wait()


def reopen(folder, room, worker=None):
    """How large a recording is, and how long it takes to open it; the same session must come of it."""
    if worker is not None:
        worker.close()
    for path in sorted(folder.glob("*.*")):
        print(f"{path.name:<15} {path.stat().st_size / 2**20:6.2f} MiB")
    with timer("journal read"):
        recording = read_recording(folder)
    with timer(f"{len(recording.lines)} steps restored"):
        session = restore(recording).session
    (room / "mended").mkdir()
    with timer("pictures checked"):
        files = pictures_of(recording, room / "mended")
    with viewer() as (client, _), timer("viewer has loaded"):
        client.open(str(files[0]))
        time.sleep(0.05)
        while (state := client.get_state()).loading or not state.recordings:
            time.sleep(0.02)
    assert worker is None or session.score.indices == worker.session.score.indices


@contextlib.contextmanager
def timer(what):
    """Print how long it takes."""
    begin_ = time.perf_counter()
    yield
    print(f"{what:<24} {time.perf_counter() - begin_:6.2f} s", flush=True)


class Seen(AbstractKeeper):
    """Remembers every step, and how the session began."""

    def __init__(self):
        self.first, self.steps = None, []

    def begin(self, session, *, step, at, tell):
        self.first = session

    def note(self, step, entry, session):
        self.steps.append((step, entry, session))

    def close(self):
        pass


def drags(room, count):
    """Whole drags: some are done, and recorded again and again."""
    folder = room / "drags"
    begun, seen = begin(load_robot("aria"), load_plate("table2"), folder=folder), Seen()
    worker = Worker(begun.session, keepers=(seen,))
    for k in range(PER_DRAG):
        do(worker, places(worker.session, PLACES, target=k % 10, turn=k))
    worker.close()
    (journal,) = begun.keepers
    journal.begin(seen.first, step=0, at=0.0, tell=print)
    outlet = FileOutlet(folder / "session.rrd", "slowly", blueprint=blueprint(seen.first))
    drawing, handed_on = Drawing(Canvas([outlet])), 0.0
    for moment in thinned(noted(seen, journal, count)):
        drawing.draw(moment)
        if moment.at - handed_on >= FILE_TICK:
            handed_on = moment.at
            outlet.stream.flush()
    journal.close()
    outlet.close()
    reopen(folder, room)


def noted(seen, journal, count):
    """The drags again and again, each step in the journal."""
    yield Moment(0, 0.0, seen.first)
    at = 0.0
    for turn in range(count // PER_DRAG):
        for number, entry, session in seen.steps:
            step = turn * seen.steps[-1][0] + number
            at += PAUSE if isinstance(entry.command, GrabTarget) else 1.0 / PLACES
            entry = replace(entry, basis=step - 1, at=at)
            journal.note(step, entry, session)
            yield Moment(step, at, session, entry)


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
        last = recording.lines[-1].entry.command if recording.lines else None
        commands = [None, *itertools.islice(endless(recording.first), done + 1)]
        assert (replace(last, start=None) if isinstance(last, MoveTarget) else last) in commands[done:]
        assert not replayed.differences
        drawn = "from the journal" if any(f.name == "drawn.rrd" for f in files) else files[0].name
        print(
            f"{k + 1:3}: {done} done, {len(recording.lines)} lines in the journal, pictures: {drawn}",
            flush=True,
        )


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        if sys.argv[1] == "kill":
            kill(Path(folder), int(sys.argv[2]) if len(sys.argv) > 2 else 20)
        elif sys.argv[1] in ("drags", "live"):
            {"drags": drags, "live": live}[sys.argv[1]](
                Path(folder), int(sys.argv[2]) if len(sys.argv) > 2 else LONG
            )
        else:
            {"cost": cost, "long": long}[sys.argv[1]](Path(folder))
