"""Guided measuring by commands: what is stored, what is refused, and what the rows become."""

from time import sleep as pause

import numpy as np
import pytest

from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.base import se3
from workbench.extras.live.panels import _status
from workbench.extras.live.session import (
    BeginMeasuring,
    DriveArm,
    EndMeasuring,
    Measuring,
    StoreRow,
    TakeAgain,
    TakeSample,
    UseRows,
)
from workbench.extras.live.sources import VirtualDriver
from workbench.extras.live.standstill import ArmState
from workbench.session import Worker, replay
from workbench.session.journal import Ending
from workbench.session.journal.codec import decode, encode
from workbench.session.next_step import Tone, next_step
from workbench.session.page_state import Severity, Tab
from workbench.session.state import Focus


def sample(measuring, q, *, time, state=ArmState.STILL):
    """What an exact instrument says of the arm."""
    pose = tool_poses(measuring.virtual.actual, Motion(q[None]))[0]
    xyz, quat = pose[:3, 3], se3.matrix_to_quaternion(pose[:3, :3])
    return TakeSample(time, *(tuple(part.tolist()) for part in (q, xyz, quat)), arm_state=state)


@pytest.fixture
def begun(do):
    return do(BeginMeasuring(3)).part(Measuring)


def test_rows_are_stored_one_by_one_and_become_the_data(do, begun, first, worker):
    for k, q in enumerate(begun.virtual.postures):
        session = do(DriveArm(), sample(begun, q, time=10.0 * k))
        assert session.playback.focus is Focus.JOG
        assert session.selected == begun.acquisition.targets[k].number
        off, _ = session.part(Measuring).acquisition.deviation()
        wanted = first.robot.base.pose @ first.plate.targets[begun.acquisition.targets[k].number].pose
        tool = tool_poses(begun.virtual.actual, Motion(q[None]))[0]
        assert np.allclose(off, (tool - wanted)[:3, 3], atol=1e-12)
        assert np.linalg.norm(off) < 3e-3
        assert len(do(StoreRow()).part(Measuring).acquisition.rows) == k + 1
    complete = worker.session
    step = next_step(complete)
    assert (step.tone, step.next.command, step.next.tab) == (Tone.GOOD, UseRows(), Tab.CALIBRATE)
    shown = _status(complete.part(Measuring).acquisition)
    assert "All targets are stored" in shown
    assert "off_mm" not in shown  # there is no target to go to any more
    session = do(UseRows())
    assert session.part(Measuring) is None
    data = session.measurements.loaded.dataset
    assert np.array_equal(data.q, begun.virtual.postures)
    assert np.allclose(
        data.position, tool_poses(begun.virtual.actual, Motion(begun.virtual.postures))[:, :3, 3], atol=1e-12
    )
    assert len(session.results.comparison) == len(data)
    again = replay(first, worker.journal)
    assert np.array_equal(again.measurements.loaded.dataset.position, data.position)


def test_what_makes_no_sense_is_said(do):
    for command in (DriveArm(), StoreRow(), TakeAgain(), UseRows(), EndMeasuring(), BeginMeasuring(-1)):
        assert do(command).page.messages[-1].severity is Severity.ERROR
    session = do(BeginMeasuring(1), BeginMeasuring(2))
    assert session.part(Measuring).virtual.seed == 1
    for q in ((0.0,), (np.nan,) * session.robot.dof):
        message_count = session.page.message_count
        session = do(TakeSample(0.0, q, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)))
        assert session.page.message_count == message_count + 1
        assert session.part(Measuring).acquisition.latest is None
    session = do(EndMeasuring())
    assert session.part(Measuring) is None
    late = TakeSample(0.0, (0.0,) * session.robot.dof, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))
    assert do(late).playback.focus is Focus.TARGET


def test_the_virtual_arm_comes_to_rest_at_the_target(first):
    worker = Worker(first)
    worker.add_view(VirtualDriver(worker, hurry=100.0))
    try:
        worker.submit(BeginMeasuring(2))
        assert worker.wait()
        goal = worker.session.part(Measuring).virtual.postures[0]
        worker.submit(DriveArm())
        for _ in range(2000):
            latest = worker.session.part(Measuring).acquisition.latest
            if latest is not None and np.abs(latest.q - goal).max() < 1e-4:
                break
            worker.wait()
            pause(0.01)
        else:
            raise AssertionError("the arm did not arrive")
        taken = [e.command for e in worker.journal if isinstance(e.command, TakeSample)]
        assert all(e.ending is Ending.DONE for e in worker.journal)
        assert decode("TakeSample", encode(taken[-1])[0], bytes) == taken[-1]
        assert np.abs(worker.session.part(Measuring).motion.start - goal).max() > 0.1
        assert len(taken) < 5  # of 50 samples
    finally:
        worker.close()
