"""What recording costs, and how large and how quick to open long sessions are.

    python tests/benchmarks/recording.py cost | live [DRAGS]

`cost`: the time of every place of a drag in a session that is recorded and in one that is not, turn by turn
in one process; and what journal and pictures take of the worker's processor time. `live`: 10 000 drags of
twenty places, as quickly as the worker takes them: size of the folder, time to read journal and pictures, to
come to the session again, and for the viewer to load. Kills: `crash_safety.py`.
"""

import contextlib
import statistics
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from tests.views.recording.viewer import viewer
from workbench.arm.built_in_arms import load_robot
from workbench.extras.review.viewer import pictures_of
from workbench.plate.plate_toml import load_plate
from workbench.session import Worker
from workbench.session.commands.drag import DropTarget, GrabTarget, MoveTarget
from workbench.session.journal.folder import begin
from workbench.session.journal.reader import read_recording
from workbench.session.journal.restore import restore
from workbench.session.view import AbstractKeeper
from workbench.views.recording.recorder import recorder

LONG, PLACES = 10_000, 20
STEPS, TURNS, GAP = 100, 6, 0.015


def recorded(folder):
    """A worker whose session is recorded as `serve` does it."""
    begun = begin(load_robot("aria"), load_plate("table2"), folder=folder)
    return Worker(begun.session, keepers=(*begun.keepers, recorder(folder)))


def places(session, count, target=0, turn=0.0):
    """One drag along a small loop, which begins at an angle [rad]."""
    start = session.history.first_plate.targets[target]
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
        median, maximum = statistics.median(keeper.times), np.percentile(keeper.times, 95)
        print(f"{name:<9} median {median:.3f} ms   p95 {maximum:.3f} ms of processor time")


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


def reopen(folder, room, worker):
    """How large a recording is, and how long it takes to open it; the same session must come of it."""
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
    assert session.score.indices == worker.session.score.indices


@contextlib.contextmanager
def timer(what):
    """Print how long it takes."""
    begin_ = time.perf_counter()
    yield
    print(f"{what:<24} {time.perf_counter() - begin_:6.2f} s", flush=True)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        if sys.argv[1] == "live":
            live(Path(folder), int(sys.argv[2]) if len(sys.argv) > 2 else LONG)
        else:
            cost(Path(folder))
