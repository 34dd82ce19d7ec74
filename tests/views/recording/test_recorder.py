"""The recorder beside a session: quick, thinned, whole; and what the commands make of recordings."""

import os
import resource
import time

import pytest

from tests.views.recording.demo import drag
from workbench import load_plate, load_robot
from workbench.session import Worker
from workbench.session.commands.drag import SelectTarget
from workbench.session.journal.folder import begin, resume
from workbench.session.journal.reader import read_recording
from workbench.session.journal.replay import restore
from workbench.views.recording.recorder import parts, recorder


def begun(folder, sample, **options):
    started = begin(sample.robot, sample.plate, folder=folder)
    return Worker(started.session, keepers=(*started.keepers, recorder(folder, **options)))


def test_a_drag_is_thinned_and_its_end_is_drawn(sample, reader, tmp_path):
    worker = begun(tmp_path / "r", sample)
    for way in ((0, (-0.06, 0.03, 0.05), (0.25, 0.1, 0.0)), (4, (0.05, -0.08, 0.04), (-0.2, 0.2, 0.3))):
        for command in drag(worker.session, *way):
            worker.submit(command)
            worker.wait()
    worker.close()
    pictures = reader(tmp_path / "r" / "session.rrd")
    drawn = pictures.values("/world/arm/nominal/body6", "Transform3D:translation")
    assert len(worker.journal) == 6
    assert {step for step, _ in drawn} == {0, 2, 4, 5}
    assert len(drawn) < 20
    assert {step for step, _ in pictures.values("/log", "TextLog:text")} == {0, 1, 3, 4, 6}
    shown = pictures.values("/predicted/position_mm", "Scalars:scalars")[-1][1][0]
    assert shown == pytest.approx(1e3 * worker.session.score.position, rel=1e-12)


def test_a_session_that_goes_on_has_another_file(copy, reader):
    recording = read_recording(copy)
    again = resume(recording, restore(recording).session)
    worker = Worker(again.session, keepers=(*again.keepers, recorder(copy)), journal=again.entries)
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
    started = begin(load_robot("aria"), load_plate("table2"), folder=tmp_path / "r")
    for path in tmp_path.glob("*.rrd"):
        path.rename(tmp_path / "r" / path.name)
    Worker(started.session, keepers=(*started.keepers, recorder(tmp_path / "r"))).close()
    assert [path.name for path in parts(tmp_path / "r")] == ["session-3.rrd"]
    assert not (tmp_path / "elsewhere").exists()


def test_a_full_disk_stops_no_recorder(sample, tmp_path):
    """Pictures find no room: told once, and closing takes no time."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    started = begin(sample.robot, sample.plate, folder=tmp_path / "r")
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, hard))
    try:
        worker = Worker(started.session, keepers=[recorder(tmp_path / "r")])
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
    worker = begun(tmp_path / "r", sample, after=60.0)
    worker.submit(SelectTarget(3))
    worker.wait()
    time.sleep(0.3)
    assert not parts(tmp_path / "r")
    worker.close()
    assert parts(tmp_path / "r")[0].stat().st_size > 10_000
