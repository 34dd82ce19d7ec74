"""The region and its cubes: chores work them out, fields agree with computations of their own."""

import threading
from dataclasses import replace

import numpy as np
import pytest
from session_at_work import carry_out as after

import workbench as wb
from workbench import Motion, tool_poses
from workbench.arm.inverse import solve as inverse
from workbench.base import se3
from workbench.base.progress import cancelled
from workbench.plate.predicted_error import predicted_error
from workbench.plate.target_readings import assumptions, sigma_of, usual_kind
from workbench.session import Worker
from workbench.session.command import AbstractChore
from workbench.session.commands.drag import DropTarget, GrabTarget, MoveTarget, SelectTarget
from workbench.session.commands.region import CHORES, MapCubes, SetRegion, ShowCubes
from workbench.session.commands.undo import Undo
from workbench.session.cube_fields import CHANGE, PREDICTED, drawn_field, field_of
from workbench.session.journal import Ending
from workbench.session.page_state import Severity
from workbench.session.state import CubeView
from workbench.views.drawables.plate import region as region_items
from workbench.views.page.panels import index
from workbench.views.page.panels.legend import cubes_scale

LOW, HIGH = (0.1, 0.1, 0.2), (0.5, 0.5, 0.4)


@pytest.fixture
def run(first):
    running = Worker(first)
    running.begin_chores(CHORES)
    yield running
    running.close()


def test_a_new_region_is_judged_anew(run, first):
    session = after(run, SetRegion(LOW, HIGH, 0.1))
    region = session.plate.region
    assert region.shape == (4, 4, 2)
    assert session.region.sampled is region
    tools = tool_poses(session.robot, Motion(session.region.q))[:, :3, 3]
    assert region.contains(tools).all()
    assert session.score.position != first.score.position
    assert session.history.best.score.error is session.score.error
    assert session.page.chore == ""


def test_cubes_are_looked_at_only_when_shown(run):
    assert after(run, ShowCubes(CubeView()), SetRegion(LOW, HIGH, 0.1)).region.cubes is None
    session = after(run, ShowCubes(CubeView(field="reach")))
    assert len(session.region.cubes) == 32
    assert session.region.cubes.region is session.plate.region


def test_cubes_are_evaluated_alike_after_targets_were_turned(run):
    session = after(run, SetRegion(LOW, HIGH, 0.2), ShowCubes(CubeView(field="reach")))
    turned = after(run, MoveTarget(0, (0.5, 0.3, 0.25), (0.5, 0.4, 0.3)))
    again = MapCubes.needed(turned.updated("region", cubes=None)).compute(turned)  # as once it is reopened
    assert np.array_equal(again.index, session.region.cubes.index)


def test_fields_agree_with_computations_of_their_own(run):
    session = after(run, SetRegion(LOW, HIGH, 0.1), ShowCubes(CubeView(field="predicted")))
    cubes, score = session.region.cubes, session.score
    rotations = session.plate.poses[:8, :3, :3]
    for i in (0, 13, 31):
        poses = [se3.pose(r, cubes.region.centres[i]) for r in rotations]
        assert cubes.reached[i] == sum(inverse.solve(session.robot, p).reachable for p in poses)
        tool = tool_poses(session.robot, Motion(cubes.q[i][None]))[0]
        assert tool[:3, 3] == pytest.approx(cubes.region.centres[i], abs=1e-7)
        expected = predicted_error(score.linearisation, session.robot, cubes.q[i][None])
        assert field_of(session).values(session).numbers[i] == pytest.approx(expected.position_rms, rel=1e-9)


class Stubborn(AbstractChore):
    """Wants target 1 selected; waits, or fails."""

    selected: int
    title = "Stubborn"
    key = None

    @classmethod
    def needed(cls, session):
        return None if session.selected in (0, 9) else cls(session.selected)

    def check(self, session):
        pass

    def compute(self, session):
        if self.selected == 5:
            raise ValueError("no")
        while not cancelled():
            threading.Event().wait(0.005)
        return "late"

    def finish(self, session, result):
        return replace(session, selected=9)


def test_a_chore_that_is_no_longer_needed_is_cancelled(first):
    run = Worker(first)
    run.begin_chores((Stubborn,))
    try:
        run.submit(SelectTarget(1))
        while not run.session.page.chore:
            threading.Event().wait(0.005)
        session = after(run, SelectTarget(0))
        assert session.selected == 9  # it ended and was put in, as its `finish` did not object
        session = after(run, SelectTarget(5))
        assert run.journal[-1].ending is Ending.FAILED
        assert "failed" in session.page.messages[-1].text
        failures = len(run.journal)
        run.cancel()
        assert run.wait(60.0)
        assert len(run.journal) == failures  # not tried again in the same place
    finally:
        run.close()


def test_the_page_says_what_plate_score_says(first):
    """One set of poses, one choice of branches, one statistic: the same digits."""
    found = wb.score(first.robot, first.plate).measured
    error = found.error
    assert (first.score.position, first.score.rotation) == (error.position_rms, error.rotation_rms)
    panel = index.headline(first, [])
    assert f"{1e3 * error.position_rms:.3f} mm<" in panel
    assert assumptions(first.plate, sigma_of(usual_kind(first.plate))) in panel


def test_a_drag_colours_cubes_by_what_it_changes_on_a_scale_of_that_size(run):
    before = after(run, SelectTarget(0))
    target = before.plate.targets[0]
    x, y, z = target.xyz.tolist()
    assert drawn_field(before) is PREDICTED
    spans = []
    for off in (0.02, 0.12):
        rpy = tuple(target.rpy.tolist())
        session = after(run, GrabTarget(0, client=1), MoveTarget(0, (x - off, y, z), rpy, client=1))
        field = drawn_field(session)
        assert field is CHANGE
        change = field.values(session)
        wanted = field_of(session).values(session).numbers / field_of(before).values(before).numbers - 1.0
        seen = np.isfinite(wanted)
        assert np.allclose(change.numbers[seen], wanted[seen], atol=1e-12)
        assert -change.low == change.high
        shares = change.shares[seen]
        assert np.percentile(shares, 97.0) - np.percentile(shares, 3.0) > 0.2  # one sees it
        assert f"+{100 * change.high:.3g}"[:4] in cubes_scale(session)
        assert session.drag in next(i for i in region_items(session) if i.path == "region/cubes").inputs
        spans.append(change.high)
        released = after(run, DropTarget(client=1), Undo())
        assert drawn_field(released) is PREDICTED
    assert spans[0] < spans[1]
    assert after(run, ShowCubes(CubeView(field="change"))).page.messages[-1].severity is Severity.ERROR
