"""A trajectory in a recording: planned, looked at, done again."""

import numpy as np
import pytest

from workbench.extras.trajectories.session import PlanTrack, planned_track
from workbench.session import Worker
from workbench.session.commands.playing import PlaceTrack
from workbench.session.journal.folder import begin
from workbench.session.journal.reader import read_recording
from workbench.session.journal.restore import restore
from workbench.views.appearance.bodies import body_frames
from workbench.views.recording.recorder import recorder


def test_a_trajectory_is_drawn_and_done_again(sample, reader, tmp_path):
    begun = begin(sample.robot, sample.plate, folder=tmp_path / "r")
    worker = Worker(begun.session, keepers=(*begun.keepers, recorder(begun.folder)))
    for command in (PlanTrack(), PlaceTrack(2.5)):
        worker.submit(command)
        assert worker.wait(60.0)
    track = planned_track(worker.session)
    worker.close()
    pictures = reader(begun.folder / "session.rrd")
    for name, places in (("wanted", track.wanted), ("trail", track.reached)):
        ((step, ((strip,),)),) = [
            (step, (value,)) for step, value in pictures.values(f"/world/track/{name}", "LineStrips3D:strips")
        ]
        assert step == 1
        assert np.allclose(strip, places, atol=1e-6)
    last = pictures.values("/world/arm/nominal/body6", "Transform3D:translation")[-1]
    expected = body_frames(sample.robot, track.at(2.5))[6][:3, 3]
    assert last == (2, [pytest.approx(expected.tolist(), abs=1e-6)])
    replayed = restore(read_recording(begun.folder))
    assert replayed.differences == ()
    assert planned_track(replayed.session).q.tolist() == track.q.tolist()
