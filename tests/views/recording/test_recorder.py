"""The recorder beside a session: quick, thinned, whole; and what the commands make of recordings."""

import os
import resource
import shutil
import time

import pytest

from tests.views.recording.demo import drag
from workbench.arm.built_in_arms import load_robot
from workbench.plate.plate_toml import load_plate
from workbench.session import Worker
from workbench.session.commands.drag import DropTarget, GrabTarget, MoveTarget, SelectTarget
from workbench.session.commands.undo import Undo
from workbench.session.journal.entry import Ending, Entry
from workbench.session.journal.folder import begin, resume
from workbench.session.journal.numbers import changed_numbers
from workbench.session.journal.reader import read_recording
from workbench.session.journal.restore import restore
from workbench.views.recording.contents import thinned
from workbench.views.recording.recorded_step import INTERVAL, Moment
from workbench.views.recording.recorder import parts, recorder


@pytest.fixture
def copy(sample, tmp_path):
    return shutil.copytree(sample.folder, tmp_path / "copy")


def live(folder, robot, plate, commands):
    begun = begin(robot, plate, folder=folder)
    worker = Worker(begun.session, keepers=(*begun.keepers, recorder(folder)))
    for command in commands(begun.session):
        worker.submit(command)
        worker.wait()
    worker.close()
    return worker


def test_a_drag_is_thinned_and_its_end_is_drawn(sample, reader, tmp_path):
    def commands(session):
        yield from drag(session, 0, (-0.06, 0.03, 0.05), (0.25, 0.1, 0.0))
        yield from drag(session, 4, (0.05, -0.08, 0.04), (-0.2, 0.2, 0.3))

    worker = live(tmp_path / "r", sample.robot, sample.plate, commands)
    pictures = reader(tmp_path / "r" / "session.rrd")
    drawn = pictures.values("/world/arm/nominal/body6", "Transform3D:translation")
    assert len(worker.journal) == 6
    assert {step for step, _ in drawn} == {0, 2, 4, 5}
    assert len(drawn) < 20
    assert {step for step, _ in pictures.values("/log", "TextLog:text")} == {0, 1, 3, 4, 6}
    shown = pictures.values("/predicted/position_mm", "Scalars:scalars")[-1][1][0]
    assert shown == pytest.approx(1e3 * worker.session.score.position, rel=1e-12)


def test_what_is_passing_is_thinned_by_time_but_decisions_are_not(replayed):
    session = replayed.session
    move = next(drag(session, 0, (0.0, 0.0, 0.1), (0.0, 0.0, 0.0)))  # a grab, a decision
    passing = list(drag(session, 0, (0.0, 0.0, 0.1), (0.0, 0.0, 0.0)))[1]

    def moment(step, command, at):
        return Moment(step, at, session, Entry(command, Ending.DONE, 0, 0.0, 0.0, at=at))

    moments = [moment(k, move if k % 10 == 0 else passing, 0.01 * k) for k in range(101)]
    kept = [m.step for m in thinned(moments)]
    assert set(range(0, 101, 10)) <= set(kept)
    assert set(range(9, 100, 10)) <= set(kept)  # the last place of every drag
    assert len(kept) < 45
    slow = [moment(k, passing, 2 * INTERVAL * k) for k in range(10)]
    assert [m.step for m in thinned(slow)] == list(range(10))


def test_a_session_that_goes_on_has_another_file(copy, reader):
    recording = read_recording(copy)
    begun = resume(recording, restore(recording).session)
    worker = Worker(begun.session, keepers=(*begun.keepers, recorder(copy)), journal=begun.entries)
    worker.submit(SelectTarget(5))
    worker.wait()
    worker.close()
    assert [p.name for p in parts(copy)] == ["session.rrd", "session-2.rrd"]
    pictures = reader(copy / "session-2.rrd")
    steps = [step for step, _ in pictures.values("/log", "TextLog:text")]
    assert steps == [len(recording.lines), len(recording.lines) + 1]


def test_pictures_that_are_links_or_pipes_are_neither_shown_nor_written(tmp_path):
    (tmp_path / "session.rrd").symlink_to(tmp_path / "elsewhere")
    os.mkfifo(tmp_path / "session-2.rrd")
    begun = begin(load_robot("aria"), load_plate("table2"), folder=tmp_path / "r")
    for path in tmp_path.glob("*.rrd"):
        path.rename(tmp_path / "r" / path.name)
    worker = Worker(begun.session, keepers=(*begun.keepers, recorder(tmp_path / "r")))
    worker.close()
    assert [path.name for path in parts(tmp_path / "r")] == ["session-3.rrd"]
    assert not (tmp_path / "elsewhere").exists()


def test_a_restored_session_is_the_replayed_one(sample, replayed):
    again = restore(sample)
    assert again.differences == ()
    a, b = (found.session.results.identification.runs["opt2"].fit.x for found in (again, replayed))
    assert a.tolist() == b.tolist()


def same_targets(restored, again):
    """Places, postures, scores, and what can be gone back to, to the last digit."""
    assert changed_numbers(restored, None) == changed_numbers(again, None)
    for a, b in zip(
        (*restored.history.done, restored.history.best),
        (*again.history.done, again.history.best),
        strict=True,
    ):
        assert [s.q.tolist() for s in a.states] == [s.q.tolist() for s in b.states]
        assert [t.xyz.tolist() for t in a.plate.targets] == [t.xyz.tolist() for t in b.plate.targets]
    assert [s.indices for s in restored.history.scores] == [s.indices for s in again.history.scores]
    assert restored.drag == again.drag


def test_drags_out_of_reach_and_back_are_restored(sample, tmp_path):
    """Out of reach, back in another branch, held by another, not moved, typed, undone, left in the air."""

    def commands(session):
        yield from drag(session, 7, (0.30, 0.20, 0.60), (0.0, 0.0, 0.0))
        yield GrabTarget(7, 1)
        yield MoveTarget(7, (0.4, -0.3, 0.3), (3.0, 0.3, 1.0), 1)
        yield MoveTarget(7, (0.3, -0.4, 0.3), (3.0, 0.3, 1.0), 2)
        yield MoveTarget(7, (0.3, -0.4, 0.2), (3.0, 0.0, 1.5), 1)
        yield DropTarget(1)
        yield from (GrabTarget(3, 1), DropTarget(2), DropTarget(1), SelectTarget(8))
        yield MoveTarget(2, (0.45, 0.4, 0.25), (-2.6, 0.0, 0.0))
        yield Undo()
        for number in range(10):
            yield from (GrabTarget(number, 1), MoveTarget(number, (3.0, 3.0, 3.0), (0.0, 0.0, 0.0), 1))
            yield DropTarget(1)
        yield from drag(session, 2, (-0.02, 0.0, 0.03), (0.0, 0.0, 0.2))
        yield from list(drag(session, 5, (0.03, 0.0, 0.03), (0.0, 0.0, 0.2)))[:-1]

    worker = live(tmp_path / "r", sample.robot, sample.plate, commands)
    recording = read_recording(tmp_path / "r")
    assert len(recording.lines) == len(worker.journal)
    restored = restore(recording)
    assert restored.differences == ()
    same_targets(restored.session, worker.session)


def test_a_full_disk_stops_no_recorder(sample, tmp_path):
    """Pictures find no room: told once, and closing takes no time."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    begun = begin(sample.robot, sample.plate, folder=tmp_path / "r")
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, hard))
    try:
        worker = Worker(begun.session, keepers=[recorder(tmp_path / "r")])
        for k in range(10):
            worker.submit(SelectTarget(k))
            worker.wait()
        started = time.monotonic()
        while not worker.session.page.messages and time.monotonic() - started < 60.0:
            time.sleep(0.05)
        worker.close()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert [m.text for m in worker.session.page.messages if "session.rrd can't be written" in m.text]
    assert worker.session.selected == 9


def test_the_first_picture_of_the_page_goes_before_the_recording_and_nothing_is_lost(sample, tmp_path):
    begun = begin(sample.robot, sample.plate, folder=tmp_path / "r")
    worker = Worker(begun.session, keepers=[recorder(tmp_path / "r", after=60.0)])
    worker.submit(SelectTarget(3))
    worker.wait()
    time.sleep(0.3)
    assert not parts(tmp_path / "r")
    worker.close()
    assert parts(tmp_path / "r")[0].stat().st_size > 10_000
