"""The plate tab's pictures: worth of targets, history, whether an error is good; ghosts and reach."""

from dataclasses import replace

import numpy as np
import pytest
from refusals import mentions

import workbench as wb
from workbench import Motion, load_robot, tool_poses
from workbench.arm.kinematics.envelope import ring_at
from workbench.base import se3
from workbench.session.commands.drag import GrabTarget, MoveTarget
from workbench.session.commands.undo import GoBackTo, Undo
from workbench.session.start import default_circle
from workbench.session.state import Drag
from workbench.session.target_steps import score_as_drawn
from workbench.views.drawables.region import envelope
from workbench.views.page.panels.history import plot
from workbench.views.page.panels.index import _details, headline


@pytest.fixture(scope="module")
def moved(first):
    """Two steps later."""
    session = first
    for number, x in ((0, 0.45), (4, 0.33)):
        target = session.plate.targets[number]
        session = MoveTarget(number, (x, *target.xyz[1:].tolist()), tuple(target.rpy.tolist())).apply(session)
    return session


def test_a_plate_that_states_no_tolerances_shows_its_error_as_drawn_beside_the_exact_one(first):
    """It was 57 % larger, and said only once the plate was saved."""
    drawn = score_as_drawn(first).position
    q = np.stack([state.q for state in first.states])
    sheet = wb.score(
        first.robot,
        first.plate.made_as_drawn.with_joints(q, first.plate.branches),
        evaluation_poses=first.region.q,
    )
    assert drawn == pytest.approx(sheet.measured.error.position_rms)
    assert drawn > 1.1 * first.score.position
    assert f"{1e3 * drawn:.3f} mm if it is only made" in _details(first)
    assert "only made" not in _details(replace(first, drag=Drag(1, 0)))  # a drag waits for nothing
    stated = replace(first, plate=first.plate.made_as_drawn)
    assert score_as_drawn(stated) is None
    assert default_circle(load_robot("ur5")).production == stated.plate.production


def test_error_and_index_of_the_plate_stand_side_by_side_with_their_curves(first):
    shown = headline(first, [(1e-3, 0.6), (2e-3, 0.5), (np.inf, 0.4)])
    assert f">{1e3 * first.score.position:.3f} mm<" in shown
    assert f">O {first.score.per_target.mean():.4f}<" in shown
    assert shown.count("<polyline") == shown.count("<svg") == headline(first, []).count("<svg") == 2


def test_the_history_has_numbers_and_any_step_can_be_gone_back_to(first, moved):
    assert len(moved.history.past) == 3
    text = plot([step.score.position for step in moved.history.past], 0)
    assert text.count("<circle") == 4  # the best one twice
    best = 1e3 * min(step.score.position for step in moved.history.past)
    assert f"{best:.3f}" in text
    assert mentions(text, "step 1")
    assert "inf" not in plot([1e-3, np.inf, 2e-3], 0)  # out of reach in between
    back = GoBackTo(0).apply(moved)
    assert back.plate is first.plate
    assert len(back.history.past) == 4
    assert Undo().apply(back).plate is moved.plate


def test_the_reach_is_shown_during_a_drag_alone(first):
    assert list(envelope(first)) == []
    dragged = GrabTarget(2, client=1).apply(first)
    ring, message = [item.make(*item.inputs) for item in envelope(dragged)]
    assert ring.places[:, 2] == pytest.approx(first.plate.targets[2].xyz[2], abs=0.021)
    assert message.text == "reach"


@pytest.mark.parametrize("name", ["aria", "katana450"])
def test_no_posture_at_a_height_is_far_beyond_the_ring(name):
    robot, height = load_robot(name), 0.1
    ring = ring_at(robot, height)
    q = np.random.default_rng(9).uniform(*robot.search_limits.T, (20_000, robot.dof))
    places = se3.apply(se3.inverse(robot.base.pose), tool_poses(robot, Motion(q))[:, :3, 3])
    near = places[np.abs(places[:, 2] - height) < 0.01]
    farthest = np.hypot(*near[:, :2].T).max()
    outermost = np.hypot(*ring[:, :2].T).max()
    assert 0.9 * farthest < outermost < 1.05 * robot.reach
    assert len(ring_at(robot, 9.0)) == 0
