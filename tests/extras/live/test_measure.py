"""Guided measuring by commands: what is stored, what is refused, and what the rows become."""

from dataclasses import replace

import numpy as np
import pytest
from refusals import mentions, refuses

from workbench import Motion, tool_poses
from workbench.base import se3
from workbench.base.errors import OptionError
from workbench.extras.live import session as guided
from workbench.extras.live.commands import LiveOption
from workbench.extras.live.panels import status
from workbench.extras.live.standstill import ArmState
from workbench.session import replay
from workbench.session.journal.codec import decode, encode
from workbench.session.journal.folder import unrecorded_session
from workbench.session.next_step import Tone, next_step
from workbench.session.page_state import Severity, Tab
from workbench.session.state import Focus
from workbench.views.page.app import App


def sample(robot, q, *, time, off=0.0):
    """What an exact instrument says of an arm, which is off along x [m]."""
    pose = tool_poses(robot, Motion(np.array([q])))[0]
    xyz, quat = pose[:3, 3] + [off, 0.0, 0.0], se3.matrix_to_quaternion(pose[:3, :3])
    q, xyz, quat = (tuple(np.asarray(part).tolist()) for part in (q, xyz, quat))
    return guided.TakeSample(time, q, xyz, quat, arm_state=ArmState.STILL)


@pytest.fixture
def begun(do):
    return do(guided.TellSource("arm"), guided.MeasureLive())


def test_rows_are_stored_one_by_one_and_become_the_data(do, begun, first, worker):
    postures = np.stack([state.q for state in first.states])
    for k, q in enumerate(postures):
        session = do(sample(first.robot, q, time=10.0 * k, off=1e-3))
        assert session.playback.focus is Focus.JOG
        off, _ = session.part(guided.Measuring).acquisition.deviation()
        assert np.allclose(off, [1e-3, 0.0, 0.0], atol=1e-6)
        assert len(do(guided.StoreRow()).part(guided.Measuring).acquisition.rows) == k + 1
    complete = worker.session
    step = next_step(complete)
    assert (step.tone, step.next.command, step.next.tab) == (Tone.GOOD, guided.UseRows(), Tab.CALIBRATE)
    shown = status(complete.part(guided.Measuring).acquisition)
    assert "All targets are stored" in shown
    assert "off_mm" not in shown  # there is no target to go to any more
    session = do(guided.UseRows())
    assert session.part(guided.Measuring) is None
    data = session.measurements.loaded.dataset
    assert np.array_equal(data.q, postures)
    seen = tool_poses(first.robot, Motion(postures))[:, :3, 3] + [1e-3, 0.0, 0.0]
    assert np.allclose(data.position, seen, atol=1e-12)
    assert not session.measurements.loaded.virtual
    assert len(session.results.comparison) == len(data)
    again = replay(first, worker.journal)
    assert np.array_equal(again.measurements.loaded.dataset.position, data.position)


def test_what_makes_no_sense_is_said(do):
    for kind in (guided.StoreRow, guided.TakeAgain, guided.UseRows, guided.EndMeasuring, guided.MeasureLive):
        assert do(kind()).page.messages[-1].severity is Severity.ERROR
    session = do(guided.TellSource("arm"), guided.MeasureLive(), guided.MeasureLive())
    assert session.page.messages[-1].severity is Severity.ERROR
    empty = replace(session.plate, targets=())
    with refuses(OptionError, "no targets"):
        guided.MeasureLive().check(replace(session.without_part(guided.Measuring), plate=empty))
    for q in ((0.0,), (np.nan,) * session.robot.dof):
        message_count = session.page.message_count
        session = do(guided.TakeSample(0.0, q, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)))
        assert session.page.message_count == message_count + 1
        assert session.part(guided.Measuring).acquisition.latest is None
    assert do(guided.EndMeasuring()).part(guided.Measuring) is None
    session = do(guided.TellSource("arm", is_open=False), guided.MeasureLive())
    assert (session.part(guided.Source).is_open, session.part(guided.Measuring)) == (False, None)


def test_an_arm_that_is_only_followed_is_one_step_of_the_journal(worker, do, first):
    """It grew by 0.6 MB a minute."""
    samples = [guided.TakeSample(0.05 * k, tuple((np.full(6, 0.1) + 1e-3 * k).tolist())) for k in range(200)]
    live = do(guided.TellSource("arm"), *samples)
    assert [type(e.command) for e in worker.journal] == [guided.TellSource, guided.TakeSample]
    assert (
        replay(first, worker.journal).playback.jogged.tolist()
        == live.playback.jogged.tolist()
        == list(samples[-1].q)
    )


def test_a_measurement_keeps_only_the_newest_sample_before_each_row(worker, do, begun, first):
    for k in range(3):
        q = np.array(first.states[k].q)
        do(*(guided.TakeSample(k + 0.01 * i, tuple((q + 1e-5 * i).tolist())) for i in range(100)))
        live = do(guided.StoreRow()).part(guided.Measuring).acquisition
    again = replay(first, worker.journal).part(guided.Measuring).acquisition
    assert [row.q.tolist() for row in again.rows.values()] == [row.q.tolist() for row in live.rows.values()]
    assert (again.latest.time, again.arm_state, len(again.rows)) == (live.latest.time, live.arm_state, 3)
    steps = [e.command for e in worker.journal if isinstance(e.command, guided.TakeSample)]
    assert len(steps) == 3
    assert decode("TakeSample", encode(steps[0])[0], bytes) == steps[0]


def test_a_source_of_then_is_said_to_have_ended(app):
    begun = unrecorded_session(app.worker.session.robot, app.worker.session.plate)
    session = begun.session.with_part(guided.Source("localhost:5000"))
    with LiveOption().opened() as make:
        again = App(session.robot, session.plate, begun=replace(begun, session=session), beside=[make])
    try:
        assert again.worker.wait(60.0)
        assert not again.worker.session.part(guided.Source).is_open
        assert mentions(again.worker.session.page.messages[-1].text, "localhost:5000")
    finally:
        again.close()
