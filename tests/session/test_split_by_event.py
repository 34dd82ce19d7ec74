"""The rows after an event as a session of their own: asked for on the page, undone, replayed."""

import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from refusals import refuses
from slow import slow

from tests.session.direct_commands import done
from workbench.arm.effects.events import FrameStep, ToolStep, ZeroStep
from workbench.base.errors import DataError
from workbench.base.types import Freedom
from workbench.data.writer import write_measurements
from workbench.session import Worker, start
from workbench.session.commands.data import LoadData
from workbench.session.commands.diagnose import Diagnose
from workbench.session.commands.identify import LeaveRowsOut
from workbench.session.commands.sessions import MakeSession, new_frames
from workbench.session.commands.undo import Redo, Undo
from workbench.session.next_step import next_step
from workbench.session.start import default_plate

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "benchmarks"))
from events import CASES, make


def loaded(name, folder):
    """A session with the rows of an arm to which something happened, and what that was."""
    made = make(CASES[name], 0, "aria")
    content = write_measurements(made.data, folder / "rows.csv").read_bytes()
    return done(start(made.robot, default_plate(made.robot)), LoadData("rows.csv", content)), made.truth


@pytest.mark.parametrize(("name", "kind"), [("slip", ToolStep), slow("knock", FrameStep)])
def test_with_a_session_of_their_own_nothing_happens_any_more(name, kind, tmp_path):
    first, (truth,) = loaded(name, tmp_path)
    worker = Worker(first)
    try:
        for command in (LeaveRowsOut((3,)), Diagnose()):
            worker.submit(command)
        assert worker.wait(120.0)
        found = worker.session.results.diagnosis
        (event,) = found.events
        assert isinstance(event, kind)
        assert list(new_frames(found)) == [event.row]
        assert next_step(worker.session).next.command == MakeSession(event.row)
        if kind is FrameStep:
            a_known_base_becomes_no_sessions_own(worker.session, event.row)
        for command in (MakeSession(event.row), Diagnose()):
            worker.submit(command)
        assert worker.wait(120.0)
        after = worker.session
        data = after.measurements.loaded.dataset
        assert np.array_equal(data.session == data.session[-1], data.row >= event.row)
        assert after.results.diagnosis.effects == ()
        assert not len(after.results.diagnosis.outliers)
        one, both = (each.remaining.noise.position for each in (after.results.diagnosis, found))
        assert one == pytest.approx(both, rel=0.1)
        between = {row for row, _ in found.excluded} - {3}
        assert after.measurements.left_out == {3} | between
        assert all(min(truth.row, event.row) <= row < event.row for row in between)
        for command in (Undo(), Undo(), Redo(), Undo()):
            worker.submit(command)
        assert worker.wait(60.0)
        assert worker.session.results.diagnosis is found
        assert worker.session.measurements.loaded.dataset.session is None
        assert worker.session.measurements.left_out == {3}
    finally:
        worker.close()


def test_a_joint_has_no_frame_of_its_own():
    events = ZeroStep((2,), row=3), ToolStep(row=4)
    found = SimpleNamespace(causes=[SimpleNamespace(event=e, sentence=e.name) for e in events])
    assert new_frames(found) == {4: "tool-step"}


def a_known_base_becomes_no_sessions_own(session, row):
    base = replace(session.robot.base, free=Freedom.FIXED)
    with refuses(DataError, "[base]"):
        MakeSession(row).check(replace(session, robot=session.robot.with_frames(base=base)))
