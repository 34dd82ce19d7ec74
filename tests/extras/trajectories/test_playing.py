"""Trajectories by commands: what the calibrated arm makes of them, and what ends them."""

import numpy as np
import pytest

from workbench.arm.frame import Frame
from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.extras.trajectories.session import PlanTrack, planned_track
from workbench.session import Worker
from workbench.session.commands.arm import Jog, drawn_joints
from workbench.session.commands.data import MeasureVirtualArm
from workbench.session.commands.drag import SelectTarget
from workbench.session.commands.identify import Identify
from workbench.session.commands.playing import LeaveTrack, PauseTrack, PlaceTrack, PlayTrack, SetPace
from workbench.session.played_motion import Played
from workbench.session.state import Focus


@pytest.fixture(scope="module")
def fitted(first):
    running = Worker(first)
    for command in (MeasureVirtualArm(3, more=20), Identify(("ols",))):
        running.submit(command)
        assert running.wait(120.0)
    running.close()
    return running.session


def free(robot):
    """An arm in its own base frame."""
    return robot.with_frames(base=Frame())


def test_the_calibrated_arm_misses_the_path_and_a_correction_meets_it(fitted):
    running = Worker(fitted)
    tracks = []
    for is_corrected in (False, True):
        running.submit(PlanTrack("circle", 8.0, is_corrected))
        assert running.wait(120.0)
        tracks.append(planned_track(running.session))
    running.close()
    plain, corrected = tracks
    calibrated = free(fitted.results.identification.runs["ols"].calibrated)
    planned = free(fitted.robot).with_frames(tool=calibrated.tool)
    away = tool_poses(calibrated, Motion(plain.q))[:, :3, 3] - tool_poses(planned, Motion(plain.q))[:, :3, 3]
    assert np.allclose(plain.errors, np.linalg.norm(away, axis=1), atol=1e-9)
    assert plain.errors.min() > 1e-3
    assert np.allclose(corrected.before, plain.errors, atol=1e-12)
    assert corrected.errors.max() < 1e-6
    region = fitted.plate.region
    radius = np.linalg.norm(plain.wanted - 0.5 * (region.min + region.max), axis=1)
    assert np.allclose(radius, 0.3 * (region.max - region.min)[:2].min(), atol=1e-6)
    assert "with correction" in running.session.page.messages[-1].text


def test_play_is_a_matter_of_focus(do, first):
    session = do(PlanTrack("line", 5.0), SetPace(2.0), PlayTrack())
    track = planned_track(session)
    assert session.is_playing
    assert track.before is None
    assert np.array_equal(drawn_joints(session), track.q[0])
    session = do(PauseTrack())
    assert (session.is_playing, session.is_track_active) == (False, True)
    session = do(PlaceTrack(2.5))
    assert (session.is_track_active, session.part(Played).at, session.part(Played).pace) == (False, 2.5, 2.0)
    assert np.allclose(drawn_joints(session), 0.5 * (track.at(2.49) + track.at(2.51)), atol=1e-4)
    assert do(PlayTrack()).part(Played).at == 2.5
    for other in (SelectTarget(2), Jog(tuple(first.states[0].q.tolist()))):
        assert not do(PlayTrack(), other).is_playing
    session = do(PlaceTrack(5.0), PlayTrack())
    assert session.part(Played).at == 0.0
    session = do(LeaveTrack())
    assert session.playback.focus is Focus.TARGET
    assert planned_track(session) is track
