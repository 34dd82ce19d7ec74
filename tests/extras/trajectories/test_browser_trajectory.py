"""A trajectory in a real Chromium: planned, played, and put anywhere along it."""

import numpy as np
import pytest

from workbench.arm.built_in_arms import load_robot
from workbench.extras.trajectories.session import KATANA, planned_track
from workbench.session.commands.arm import drawn_joints
from workbench.session.played_motion import Played
from workbench.session.start import default_circle, start
from workbench.session.state import Focus
from workbench.views.appearance.bodies import body_frames


@pytest.mark.browser
def test_a_trajectory_is_planned_played_and_put_anywhere_along_it(app, look):
    screen = look()
    katana = load_robot("katana450-tilting")
    screen.show(start(katana, default_circle(katana)))
    screen.tab("Compare")
    screen.press("Plan it")
    screen.wait_text("track", "Error, mean")
    track = planned_track(app.worker.session)
    assert np.linalg.norm(track.wanted[:, None] - KATANA, axis=2).min(0).max() < 3e-3  # the thesis's points
    assert 0.5e-3 < track.errors.mean() < 3e-3
    screen.press("Play")
    started = screen.node("/track/mark")
    screen.page.wait_for_function(
        "p => Math.abs(window.__viserMutable.nodePoseData['/track/mark'].position[0] - p) > 5e-3",
        arg=started[0],
    )
    screen.shoot("playing")
    screen.press("Pause")
    screen.until(lambda session: not session.is_track_active)
    paused = app.worker.session
    assert 0.0 < paused.part(Played).at < 10.0
    for i, frame in enumerate(body_frames(paused.robot, drawn_joints(paused))):
        screen.wait_node(f"/arm/nominal/body{i}", frame[:3, 3])
    screen.press("Back to the target")
    screen.until(lambda session: session.playback.focus is Focus.TARGET)
