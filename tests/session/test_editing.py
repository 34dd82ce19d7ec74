"""Editing targets: add, copy, delete, renumber, lock, snap, patterns, tables, branches, the best so far."""

import numpy as np
import pytest

from workbench import Motion, tool_poses, write_plate
from workbench.base import se3
from workbench.plate.plate_toml import read_plate
from workbench.plate.predicted_error import predicted_error
from workbench.session import replay
from workbench.session.commands.drag import GrabTarget, MoveTarget, SelectTarget
from workbench.session.commands.edit import AddTarget, ChooseBranch, DeleteTarget, LockTarget, free_place
from workbench.session.commands.undo import RestoreBest, Undo
from workbench.session.page_state import Severity
from workbench.session.target_postures import branches_to


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
