"""Dragging, typing, undo: what happens to the targets and their numbers. Editing targets: add, copy,
delete, renumber, lock, snap, patterns, tables, branches, the best so far. Targets at which the arm
would run into the plate can't be measured: they count nowhere."""

from dataclasses import replace

import numpy as np
import pytest
from refusals import mentions
from slow import slow

import workbench as wb
from workbench import Motion, Noise, load_robot, tool_poses, write_plate, write_urdf
from workbench.arm.inverse.branch import margins, planned_margins
from workbench.arm.kinematics.skeleton import body_frames
from workbench.base import se3
from workbench.base.assets import built_in_robots
from workbench.plate.collision import hits
from workbench.plate.plate import Kind
from workbench.plate.plate_toml import read_plate
from workbench.plate.predicted_error import predicted_error
from workbench.plate.simulated_measurement import measure_plate
from workbench.plate.tolerances import Production
from workbench.session import replay, start
from workbench.session.commands.drag import NOBODY, DropTarget, GrabTarget, MoveTarget, SelectTarget
from workbench.session.commands.edit import (
    AddTarget,
    ChooseBranch,
    DeleteTarget,
    LockTarget,
    MovePlate,
    free_place,
)
from workbench.session.commands.messages import Dismiss
from workbench.session.commands.plate import SetNoise
from workbench.session.commands.undo import Redo, RestoreBest, Undo
from workbench.session.live_score import score
from workbench.session.page_state import Severity
from workbench.session.start import default_plate
from workbench.session.target_postures import branches_to, clearance
from workbench.session.target_steps import place_plate

RPY = (-2.6, 0.05, 0.1)
FEW = {"aria", "katana450", "panda", "so101", "ur10"}
"""Arms that are tried at every run."""


def assert_reached(session, i):
    """The arm's tool is where the target is."""
    tool = tool_poses(session.robot, Motion(session.states[i].q[None]))[0]
    assert np.abs(se3.pose_error(session.plate.targets[i].pose, tool)).max() < 1e-8


@pytest.mark.parametrize("name", [n if n in FEW else slow(n) for n in built_in_robots()])
def test_every_arm_begins_with_room_at_every_target_and_may_be_tried_there(name):
    """Arms began at a limit, out of reach, or with five joints in seats, which they don't fit."""
    robot = load_robot(name)
    session = start(robot, plate := default_plate(robot))
    assert [state.obstacle for state in session.states if not state.measurable] == []
    assert len(plate) == 10
    assert plate.has_seats is (robot.dof >= 6)
    left = margins(np.stack([state.q for state in session.states]), robot.limits)
    assert (left >= planned_margins(robot.limits) - 1e-9).all()


def test_an_arm_of_a_urdf_leaves_nothing_undetermined_that_any_pose_could_show(tmp_path):
    """Its six constants a joint are more than poses tell apart: 26 of 36."""
    robot = load_robot(write_urdf(load_robot("ur5"), tmp_path / "own.urdf"))
    session = start(robot, default_plate(robot))
    assert session.score.rank == session.score.visible == 26
    assert (session.score.rises > 0.0).all()
    assert session.score.indices["O1"] > 0.0


def test_a_drag_moves_the_target_and_the_arm_follows(do, first):
    session = do(GrabTarget(2, client=7))
    assert session.drag.target == session.selected == 2
    for k in range(5):
        session = do(MoveTarget(2, (0.40, 0.55 + 0.01 * k, 0.25), RPY, client=7))
        assert_reached(session, 2)
    assert session.states[2].branch == first.states[2].branch
    assert session.score.indices["O2"] != first.score.indices["O2"]
    session = do(DropTarget(client=7))
    assert session.drag is None
    assert session.history.done[-1].by == "Move target 3"
    session = do(Undo())
    assert session.page.messages[-1].text == "move target 3"
    assert session.plate is first.plate
    assert session.score.indices == first.score.indices
    session = do(Redo())
    assert session.plate.targets[2].xyz.tolist() == pytest.approx([0.40, 0.59, 0.25])


def test_nobody_else_moves_a_held_target(do, first):
    held = do(GrabTarget(0, client=1), MoveTarget(0, (0.5, 0.3, 0.25), RPY, client=1))
    assert do(DropTarget(client=2)).drag == held.drag
    other = MoveTarget(0, (0.4, 0.3, 0.25), RPY, client=2)
    for command in (other, GrabTarget(3, client=2), replace(other, client=NOBODY), Undo(), SelectTarget(4)):
        refused = do(Dismiss(), command)
        assert (refused.plate, refused.drag, refused.selected) == (held.plate, held.drag, 0)
        assert mentions(refused.page.messages[-1].text, "target 1 is being dragged")
    assert ((back := do(DropTarget(client=1, back=True))).plate, back.history.done) == (first.plate, ())


def test_out_of_reach_has_a_reason_and_does_not_count(do, first):
    session = do(MoveTarget(0, (1.6, 0.0, 0.3), RPY))
    state = session.states[0]
    assert not state.reached
    assert mentions(state.reason, "reach", "698 mm")
    assert session.score.measurable == 9
    assert np.isnan(session.score.per_target[0])
    assert_reached(do(MoveTarget(0, tuple(first.plate.targets[0].xyz), tuple(first.plate.targets[0].rpy))), 0)


def test_no_target_in_reach_is_said_not_raised(do):
    session = do(*(MoveTarget(i, (3.0, 0.0, 0.3), RPY) for i in range(10)))
    assert session.score.measurable == session.score.rank == 0
    assert np.isinf(session.score.position)
    assert set(session.score.indices.values()) == {0.0}


def test_noise_scales_the_prediction_of_now_and_then(do, first):
    session = do(SetNoise(2 * first.noise.position, 2 * first.noise.rotation))
    assert session.score.position == pytest.approx(2 * first.score.position)
    assert session.history.first.score.position == pytest.approx(session.score.position)


def test_the_plate_is_put_elsewhere_with_all_its_targets(do, first):
    x, y, z = np.add(first.plate.xyz, (0.02, -0.03, -0.04)).tolist()
    session = do(MovePlate((x, y, z), (0.0, 0.0, 0.1)))
    (x1, y1), (x0, y0) = (plate.poses[3, :2, 3] - plate.xyz[:2] for plate in (session.plate, first.plate))
    assert np.arctan2(y1, x1) - np.arctan2(y0, x0) == pytest.approx(0.1 - first.plate.rpy[2], abs=1e-9)
    assert session.plate.heights == pytest.approx(first.plate.heights, abs=1e-12)
    assert_reached(session, 3)
    assert do(Undo()).plate is first.plate


def test_other_targets_are_read_as_they_are_unless_an_instrument_was_chosen(first):
    """A plate of sockets was scored with the noise of seats, unlike in `plate score`."""
    sockets = tuple(replace(target, kind=Kind.SOCKET) for target in first.plate.targets[:6])
    plate = replace(first.plate, targets=sockets)
    placed = place_plate(first, plate)
    assert placed.noise == Noise(5e-5, first.noise.rotation)
    q = np.stack([state.q for state in placed.states])
    fixed = placed.plate.with_joints(q, tuple(state.branch for state in placed.states))
    found = wb.score(first.robot, fixed, evaluation_poses=first.region.q)
    assert placed.score.position == pytest.approx(found.measured.error.position_rms)
    back = Undo().apply(placed)  # the seats kept the sockets' instrument
    assert (back.noise, back.score.position) == (first.noise, pytest.approx(first.score.position))
    assert Redo().apply(back).noise == placed.noise
    chosen = Noise(2e-4, 1e-3)
    assert place_plate(replace(first, noise=chosen), plate).noise == chosen


def test_a_plate_is_scored_as_it_is_made_and_read(first):
    """The page left out making and play: a loosely made plate seemed as good as any."""
    options = {"noise": first.noise, "region_q": first.region.q}
    production = Production(tolerance=(2.5e-4, float(np.deg2rad(0.3))))
    loose = score(first.robot, replace(first.plate, production=production), first.states, **options)
    assert loose.position > 1.5 * first.score.position
    sockets = tuple(replace(target, kind=Kind.SOCKET) for target in first.plate.targets[:5])
    mixed = replace(first.plate, targets=(*sockets, *first.plate.targets[5:]))
    found = score(first.robot, mixed, first.states, **options)
    assert len(found.linearisation.jacobian) == 5 * 3 + 5 * 6


def places(session):
    return session.plate.poses[:, :3, 3]


def test_add_delete_and_undo(do, first):
    session = do(AddTarget((0.3, 0.35, 0.235)), AddTarget((0.36, 0.35, 0.235)))
    assert len(session.plate) == len(session.states) == 12
    assert session.selected == 11
    assert session.plate.targets[11].rpy is first.plate.targets[0].rpy
    session = do(DeleteTarget(0))
    assert places(session)[0] == pytest.approx(places(first)[1])
    assert len(session.score.per_target) == 11
    session = do(Undo(), Undo(), Undo())
    assert session.plate is first.plate


def test_added_targets_stand_in_free_places_of_the_region(do, first):
    session = first
    for _ in range(6):
        session = do(AddTarget(free_place(session)))
    added, region = places(session)[10:], session.plate.region
    gaps = np.linalg.norm(added[:, None] - places(session), axis=-1)
    assert np.sort(gaps, axis=1)[:, 1].min() == pytest.approx(0.06)
    assert (added[:, :2] >= region.min[:2]).all()
    assert (added[:, :2] <= region.max[:2]).all()


def test_a_locked_target_stays_in_place_through_everything(do, first, tmp_path):
    held = do(LockTarget(3, True))
    rpy = (-2.6, 0.0, 0.0)
    for command in (MoveTarget(3, (0.4, 0.4, 0.3), rpy), GrabTarget(3, 7), DeleteTarget(3)):
        session = do(command)
        assert session.plate is held.plate
        assert "locked" in session.page.messages[-1].text
    assert places(session)[3] == pytest.approx(places(first)[3])
    assert read_plate(write_plate(session.plate, tmp_path / "p.toml")).targets[3].locked
    assert not do(LockTarget(3, False)).plate.targets[3].locked


def test_a_branch_chosen_by_hand_is_taken_and_kept(do):
    session = do(SelectTarget(4))
    now = session.states[4].branch
    found = branches_to(session.robot, session.plate.targets[4])
    other = next(branch for branch in found if branch.name != now)
    session = do(ChooseBranch(4, other.name))
    assert session.states[4].branch == other.name
    tool = tool_poses(session.robot, Motion(session.states[4].q[None]))[0]
    assert np.abs(se3.pose_error(session.plate.targets[4].pose, tool)).max() < 1e-8
    assert do(ChooseBranch(4, "auto")).plate.targets[4].branch == "auto"
    assert do(ChooseBranch(4, "nonsense")).page.messages[-1].severity is Severity.ERROR


def test_the_contribution_of_a_target_is_what_is_lost_without_it(do, first):
    rise = first.score.rises[6]
    session = do(DeleteTarget(6))
    full = predicted_error(first.score.linearisation, first.robot, first.region.q).position_rms
    rest = predicted_error(session.score.linearisation, first.robot, first.region.q).position_rms
    assert rise == pytest.approx(rest / full - 1.0, rel=1e-6)


def test_the_best_so_far_comes_back(do, first, worker):
    worse = do(MoveTarget(0, (0.2, 0.36, 0.235), (-2.6, 0.0, 0.0)), DeleteTarget(7))
    assert worse.score.position > first.score.position
    assert len(worse.history.past) == 3
    session = do(RestoreBest())
    assert session.score.position == pytest.approx(min(step.score.position for step in session.history.past))
    again = replay(first, worker.journal)
    assert np.array_equal(again.plate.poses, session.plate.poses)
    assert "best" in do(RestoreBest()).page.messages[-1].text


DOWN = "shoulder right, elbow down, wrist flip"


def test_a_blocked_target_counts_neither_in_the_indices_nor_as_the_best_plate(do, first):
    blocked = do(SelectTarget(2), ChooseBranch(2, DOWN))
    state = blocked.states[2]
    assert state.reached
    assert not state.measurable
    assert "would run into the plate" in state.obstacle
    assert blocked.score.measurable == 9
    assert np.isnan(blocked.score.per_target[2])
    assert blocked.score.position > first.score.position
    assert do(Undo(), RestoreBest()).plate is first.plate


def test_the_score_of_a_plate_leaves_blocked_targets_out(first):
    named = replace(first.plate.targets[2], branch=DOWN)
    plate = replace(first.plate, targets=(*first.plate.targets[:2], named, *first.plate.targets[3:]))
    found = wb.score(first.robot, plate)
    assert [bool(hit) for hit in found.can.hits] == [i == 2 for i in range(10)]
    assert np.isnan(found.measured.per_target[2])
    assert np.isfinite(np.delete(found.measured.per_target, 2)).all()
    q = found.measured.q[[0, 1, *range(3, 10)]]
    assert not any(hits(first.robot, plate, [0, 1, *range(3, 10)], q))
    elbow = first.states[7].q
    assert clearance(first.robot, plate, elbow) == "link 2 clears the plate by 7 mm"
    moved = (replace(plate, xyz=plate.xyz - [0.0, step, 0.0]) for step in (0.006, 0.008))
    assert [bool(hits(first.robot, one, [7], elbow[None])[0]) for one in moved] == [False, True]


def test_the_table_is_in_the_way_of_elbows_below_it(first):
    robot, away = first.robot, first.plate.moved(np.array([0.0, 0.0, 5.0]), np.zeros(3))
    q = np.random.default_rng(0).uniform(*robot.limits.T, (40, robot.dof))
    lowest, found = body_frames(robot, q)[:, 2:-1, 2, 3].min(1), np.array(hits(robot, away, [0] * 40, q))
    assert {hit.partition(" would ")[2] for hit in found[lowest < 0.0]} == {"run into the table"}
    assert "" in found[lowest > 0.0]
    deep = first.plate.moved(np.array([0.0, 0.0, -5.0]), np.zeros(3))  # beside a pedestal
    assert not any(hits(robot, deep, [0] * 40, q))


def test_what_stands_in_the_way_is_said_of_a_virtual_arm_too(first):
    """Rows of blocked targets were measured like any other."""
    down = tuple(replace(target, branch=DOWN) for target in first.plate.targets)
    _, rows = measure_plate(first.robot, replace(first.plate, targets=down), actual=first.robot)
    assert np.flatnonzero(~rows.exclude).tolist() == [8]
    assert rows.reason[0] == "link 2 would run into the plate"
    assert np.isnan(rows.position[0]).all()
    _, rows = measure_plate(first.robot, first.plate)  # among what is clear
    assert rows.exclude is None
