"""A trajectory on the page: planned, played, and left for anything else."""

from time import sleep

import numpy as np

from workbench.extras.trajectories.session import PlanTrack
from workbench.extras.trajectories.track import planned_track
from workbench.session.commands.arm import drawn_joints
from workbench.session.commands.drag import SelectTarget
from workbench.session.commands.playing import PlayTrack, SetPace
from workbench.session.played_motion import Played
from workbench.session.state import Focus
from workbench.views.appearance.bodies import body_frames


def test_a_trajectory_is_played_to_its_end_and_stops_for_anything_else(app):
    def stopped():
        return any(_waited(app) and not app.worker.session.part(Played).is_running for _ in range(600))

    for command in (PlanTrack("line", 4.0), SetPace(10.0), PlayTrack()):
        app.worker.submit(command)
        assert app.worker.wait(60.0)
    assert stopped()
    session = app.worker.session
    assert session.part(Played).at == planned_track(session).duration
    assert np.array_equal(drawn_joints(session), planned_track(session).q[-1])
    arm = app.server.scene._handle_from_node_name["/arm/nominal/body6"]
    assert np.allclose(
        arm.position, body_frames(session.robot, planned_track(session).q[-1])[-1, :3, 3], atol=1e-9
    )

    for command in (SetPace(0.1), PlayTrack(), SelectTarget(4)):
        app.worker.submit(command)
        assert app.worker.wait(60.0)
    assert stopped()
    session = app.worker.session
    assert session.playback.focus is Focus.TARGET
    assert 0.0 <= session.part(Played).at < 1.0
    assert np.allclose(arm.position, body_frames(session.robot, session.states[4].q)[-1, :3, 3], atol=1e-9)


def _waited(app):
    sleep(0.05)
    return app.worker.wait(60.0)
