"""The plate tab's pictures: worth of targets, history, whether an error is good; ghosts and reach."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from refusals import mentions, refuses

import workbench as wb
from workbench.arm.built_in_arms import load_robot
from workbench.arm.kinematics.envelope import maximum_reach, ring_at
from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.motion import Motion
from workbench.base import se3
from workbench.base.errors import OptionError
from workbench.plate.plate_toml import load_plate
from workbench.session import start
from workbench.session.commands.drag import GrabTarget, MoveTarget
from workbench.session.commands.undo import GoBackTo, Undo
from workbench.session.start import default_circle
from workbench.session.state import Drag
from workbench.session.target_steps import score_as_drawn
from workbench.views.drawables.plate import plate_before
from workbench.views.drawables.region import envelope
from workbench.views.page.html import BAD, GOOD
from workbench.views.page.panels import index
from workbench.views.page.panels.history import plot
from workbench.views.page.panels.index import alone_or_together, determined, loss_bars, predicted, reading


@pytest.fixture(scope="module")
def first():
    return start(load_robot("aria"), load_plate("table2"))


@pytest.fixture(scope="module")
def moved(first):
    """Two steps later."""
    session = first
    for number, x in ((0, 0.45), (4, 0.33)):
        target = session.plate.targets[number]
        session = MoveTarget(number, (x, *target.xyz[1:].tolist()), tuple(target.rpy.tolist())).apply(session)
    return session


def test_every_bar_says_what_is_lost_without_its_target(first):
    text = loss_bars(first)
    for i, rise in enumerate(first.score.rises):
        assert f"target {i + 1}: {100 * rise:+.0f} % error without it" in text
        assert f">+{100 * rise:.0f}</text>" in text
    heights = [float(part.split('"')[0]) for part in text.split('height="')[1:]]
    assert np.argmax(heights) == np.argmax(first.score.rises)


def test_the_room_that_the_joints_have_is_said(first):
    left = np.stack([state.q for state in first.states])
    least = np.rad2deg(np.abs(left[..., None] - first.robot.limits).min())
    assert f"{least:.3g}° or more from their limits" in determined(first)


@pytest.mark.parametrize(
    ("own", "error", "text"),
    [
        (1.02, 1.007, ("less", "rises")),
        (0.97, 0.95, ("more", "falls")),
        (1.02, 0.95, ()),
        (0.97, 1.1, ()),
        (1.02, 1.0, ()),
        (1.0, 1.007, ()),
    ],
)
def test_an_index_that_rises_with_the_error_is_explained_beside_it(first, own, error, text):
    """The index is of one target alone; the error is of all of them."""
    at_first, now = first.history.first_score, first.score
    per_target = np.array(at_first.per_target)
    per_target[3] *= own
    now = replace(now, per_target=per_target, position=error * at_first.position)
    message = alone_or_together(replace(first, score=now, selected=3))
    assert bool(message) is bool(text)
    assert all(word in message for word in text)
    assert not message or message in loss_bars(replace(first, score=now, selected=3))
    assert alone_or_together(replace(first, score=now, selected=2)) == ""


def test_a_target_that_nothing_replaces_is_marked(first):
    rises = np.array(first.score.rises)
    rises[2], rises[5] = np.inf, np.nan
    text = loss_bars(replace(first, score=replace(first.score, rises=rises), selected=2))
    assert "parameters undetermined without it" in text
    assert ">!</text>" in text


@pytest.mark.parametrize(
    ("position", "expected"),
    [
        (1.25e-4, "below the error of one instrument reading (0.173 mm rms)"),
        (3.5e-4, "2.0 × the error of one reading (0.173 mm rms)"),
        (np.inf, ""),
        (np.nan, ""),
    ],
)
def test_an_error_is_held_against_the_instrument(first, position, expected):
    shown = reading(replace(first.score, position=position), 1e-4)
    assert expected in shown
    assert bool(shown) is bool(expected)


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
    assert f"as drawn {1e3 * drawn:.3f} mm" in predicted(first)
    assert "as drawn" not in predicted(replace(first, drag=Drag(1, 0)))  # a drag waits for nothing
    stated = replace(first, plate=first.plate.made_as_drawn)
    assert score_as_drawn(stated) is None
    assert default_circle(load_robot("ur5")).production == stated.plate.production


@pytest.mark.parametrize(
    ("error", "change", "text"),
    [
        (np.nan, {"sampled": None}, "Not computed yet"),
        (np.nan, {}, "does not reach the region"),
        (np.inf, {}, "Add targets"),
    ],
)
def test_an_error_without_a_number_says_what_is_missing(first, error, change, text):
    session = replace(first, score=replace(first.score, position=error)).with_region(**change)
    assert text in predicted(session)


@pytest.mark.parametrize(("error", "offered"), [(1e-9, 0.001), (2e-4, 1.0), (5.0, 1000.0), (np.inf, 1.0)])
def test_a_required_error_is_offered_that_can_be_typed(first, monkeypatch, error, offered):
    made, session = [], replace(first, score=replace(first.score, position=error))
    session = replace(session, choices=replace(session.choices, wanted=None))
    gui = SimpleNamespace(add_number=lambda label, value, **bounds: made.append((value, bounds)))
    monkeypatch.setattr(index, "ask", lambda *_, build: build(gui))
    index.try_plate(None, SimpleNamespace(session=session), None)
    ((value, bounds),) = made
    assert value == offered
    assert bounds["min"] <= value <= bounds["max"]


def test_the_history_has_numbers_and_any_step_can_be_gone_back_to(first, moved):
    assert len(moved.history.past) == len(moved.history.scores) == 3
    text = plot(moved.history.scores, 0)
    assert text.count("<circle") == 4  # the best one twice
    best = 1e3 * min(score.position for score in moved.history.scores)
    assert f"{best:.3f}" in text
    assert mentions(text, "step 1")
    back = GoBackTo(0).apply(moved)
    assert back.plate is first.plate
    assert len(back.history.scores) == len(back.history.past) == 4
    assert Undo().apply(back).plate is moved.plate


@pytest.mark.parametrize("step", [-1, 3])
def test_there_are_no_other_steps(moved, step):
    with refuses(OptionError, "1 to 3", option="step", found=step):
        GoBackTo(step).check(moved)


def test_a_ghost_stands_where_a_target_was_before_the_last_step(first, moved):
    assert list(plate_before(first)) == []
    assert [item.path for item in plate_before(moved)] == ["plate/before/5"]
    dragged = GrabTarget(2, client=1).apply(first)
    target = dragged.plate.targets[2]
    drag = MoveTarget(2, (0.3, *target.xyz[1:].tolist()), tuple(target.rpy.tolist()), client=1)
    now = drag.apply(dragged)
    (ghost,) = plate_before(now)
    assert ghost.path == "plate/before/3"
    assert np.allclose(ghost.inputs[0].xyz, target.xyz)


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


def test_the_reach_is_that_of_the_arm_and_not_the_sum_of_its_lengths():
    """A UR10 reaches 1.3 m from shoulder to wrist by its data sheet, 1.68 m if every offset counted."""
    robot = load_robot("ur10")
    assert 1.3 < maximum_reach(robot) < 1.5 < robot.reach


def test_a_plate_that_the_last_step_made_worse_is_not_green(first):
    """It may still be better than at the start."""
    far, near = (replace(first.score, position=scale * first.score.position) for scale in (0.5, 0.2))
    history = replace(first.history, first_plate=replace(first.plate), scores=(first.score, near, far))
    session = replace(first, score=far, history=history)
    assert BAD in predicted(session)
    assert GOOD in predicted(replace(session, score=near, history=replace(history, scores=(far, near))))
