"""Branches of the Table 2 plate, poses that matter, and the difference that a mix of branches makes."""

from dataclasses import replace

import numpy as np
import pytest
from refusals import refuses

from workbench.arm.frame import Frame
from workbench.arm.kinematics.forward import tool_poses
from workbench.arm.linearisation import linearise
from workbench.arm.motion import Motion
from workbench.base import se3
from workbench.base.errors import DataError, OptionError
from workbench.plate.observability import INDICES
from workbench.plate.plate import Kind, Target
from workbench.plate.poses.sampling import in_base
from workbench.plate.predicted_error import predicted_error
from workbench.plate.region import Region
from workbench.plate.region_poses import _turns, nearby_poses, region_poses
from workbench.plate.target_branches import choose_branches, plate_solutions, single_branches


def rng(seed=0):
    return np.random.default_rng(seed)


@pytest.fixture(scope="module")
def everywhere(aria, plate):
    """Any place and branch, orientations within 60° of the targets'."""
    return region_poses(
        aria, plate.region, 60, rng=rng(1), towards=plate.poses[:, :3, :3], cone=np.deg2rad(60.0)
    )


def test_every_target_of_table_2_is_reached_in_eight_ways(aria, plate, solutions):
    assert [len(target) for target in solutions] == [8] * 10
    assert len(single_branches(solutions)) == 8
    for target, branches in zip(plate.targets, solutions, strict=True):
        for branch in branches:
            assert np.allclose(tool_poses(aria, Motion(branch.q[None]))[0], target.pose, atol=1e-8)


def test_a_good_mix_of_branches_beats_every_single_one_sevenfold(aria, plate, solutions, everywhere):
    """At 0.1 mm / 0.02°: 1.2–1.5 mm with one branch for all ten targets, about 0.16 mm mixed."""
    choice = choose_branches(aria, plate, solutions, goal=everywhere, rng=rng(2))
    single = np.array(list(choice.single.values())) * 1e3
    assert ((single > 1.0) & (single < 1.8)).all()
    assert choice.cost * 1e3 == pytest.approx(0.157, abs=0.015)
    assert min(single) > 7 * choice.cost * 1e3
    assert choice.best_single == min(choice.single, key=choice.single.get)
    error = predicted_error(linearise(aria, choice.q), aria, everywhere)
    assert error.position_rms == pytest.approx(choice.cost, rel=1e-6)
    near = nearby_poses(aria, plate.region, 200, rng=rng(3), measured=choice.q)
    local = predicted_error(linearise(aria, choice.q), aria, near)
    assert local.position_mean < 0.16e-3
    assert local.rotation_mean < np.deg2rad(0.026)


@pytest.mark.parametrize("goal", ["O1", "O2", "O3", "O4", "O5"])
def test_branches_by_an_index(aria, plate, solutions, goal):
    choice = choose_branches(aria, plate, solutions, goal=goal, rng=rng(2), starts=4)
    assert -choice.cost == pytest.approx(INDICES[goal].value(linearise(aria, choice.q)), rel=1e-5)
    assert choice.cost <= min(choice.single.values())


def test_named_branches_and_joint_angles_are_kept(aria, plate, solutions, everywhere):
    name = solutions[0][3].name
    chosen = solutions[4][5]
    targets = list(plate.targets)
    targets[0] = replace(targets[0], branch=name)
    targets[4] = replace(targets[4], q=chosen.q)
    locked = replace(plate, targets=tuple(targets))
    found = plate_solutions(aria, locked)
    assert len(found[4]) == 1
    choice = choose_branches(aria, locked, found, goal=everywhere, rng=rng(2), starts=3)
    assert choice.branches[0] == name
    assert choice.branches[4] == chosen.name
    assert np.allclose(choice.q[4], chosen.q)
    kept = plate.with_joints(choice.q, choice.branches)
    assert kept.branches == choice.branches
    wrong = replace(plate, targets=(replace(targets[0], branch="upside down"), *targets[1:]))
    with refuses(DataError, target=0, found="upside down"):
        choose_branches(aria, wrong, solutions, goal="O1", rng=rng())


def test_the_base_moves_nothing(aria, plate, solutions):
    turned = aria.with_frames(base=Frame(np.array([2.0, 1.0, 0.0]), np.diag([-1.0, -1.0, 1.0])))
    there = plate_solutions(turned, plate)
    for mine, theirs in zip(solutions, there, strict=True):
        assert {b.name for b in mine} == {b.name for b in theirs}
        q = {b.name: b.q for b in theirs}
        assert all(np.allclose(q[b.name], b.q, atol=1e-7) for b in mine)


def test_an_unreachable_target_is_named(aria, plate):
    far = replace(plate, targets=(*plate.targets[:2], Target(np.array([3.0, 0.0, 0.0]))))
    with refuses(DataError, "'Table 2'", target=2):
        plate_solutions(aria, far)


def test_sockets_count_for_their_position_only(aria, plate, solutions):
    sockets = replace(plate, targets=tuple(replace(t, kind=Kind.SOCKET) for t in plate.targets))
    assert choose_branches(aria, sockets, solutions, goal="O1", rng=rng(), starts=2).cost == 0.0
    seen = tuple(n for n in aria.default_free if n[5] in "1234")
    seats = choose_branches(aria, plate, solutions, goal="O1", rng=rng(), starts=2, names=seen)
    balls = choose_branches(aria, sockets, solutions, goal="O1", rng=rng(), starts=2, names=seen)
    assert 0.0 < -balls.cost < -seats.cost
    points = linearise(aria, balls.q, sigma_rotation=None, names=seen)
    assert -balls.cost == pytest.approx(INDICES["O1"].value(points), rel=1e-5)


def test_sockets_leave_orientation_open_not_the_position(aria, plate, solutions, everywhere):
    """Turning the last frame about the tool point moves no ball: the position error stays finite."""
    sockets = replace(plate, targets=tuple(replace(t, kind=Kind.SOCKET) for t in plate.targets))
    choice = choose_branches(aria, sockets, solutions, goal=everywhere, rng=rng(), starts=2)
    assert np.isfinite(choice.cost)
    chosen = linearise(aria, choice.q, sigma_rotation=None)
    assert chosen.rank() < 24
    assert np.isinf(predicted_error(chosen, aria, everywhere).rotation_rms)
    assert choice.cost == pytest.approx(predicted_error(chosen, aria, everywhere).position_rms, rel=1e-6)


def test_an_index_of_single_poses_is_no_goal(aria, plate, solutions):
    with refuses(OptionError, option="index", found="O"):
        choose_branches(aria, plate, solutions, goal="O", rng=rng())


def test_poses_that_matter_lie_in_region_and_cone(aria, plate, solutions, everywhere):
    low, high = aria.limits.T
    tools = in_base(aria, everywhere)
    assert plate.region.contains(tools[:, :3, 3] * (1 - 1e-9)).mean() > 0.97
    gaps = se3.matrix_to_rotvec(tools[:, None, :3, :3] @ np.swapaxes(plate.poses[None, :, :3, :3], -1, -2))
    assert np.linalg.norm(gaps, axis=-1).min(1).max() <= np.deg2rad(60.0) + 1e-6
    assert ((everywhere >= low - 1e-9) & (everywhere <= high + 1e-9)).all()
    measured = next(iter(single_branches(solutions).values()))
    near = nearby_poses(aria, plate.region, 40, rng=rng(4), measured=measured)
    tools = tool_poses(aria, Motion(near))
    gaps = se3.matrix_to_rotvec(tools[:, None, :3, :3] @ np.swapaxes(plate.poses[None, :, :3, :3], -1, -2))
    assert np.linalg.norm(gaps, axis=-1).min(1).max() <= np.deg2rad(20.0) + 1e-6


def test_a_region_out_of_reach_is_said(aria):
    far = Region(min=np.array([2.0, 2.0, 2.0]), max=np.array([2.1, 2.1, 2.1]))
    with refuses(DataError, column="region", found=0):
        nearby_poses(aria, far, 5, rng=rng(), measured=np.zeros((1, 6)))


def test_turns_are_spread_evenly():
    turns = _turns(20000, rng(), np.pi)
    assert np.abs(turns.mean(0)).max() < 0.02
    trace = np.trace(turns, axis1=1, axis2=2)
    assert np.mean(trace**2) == pytest.approx(1.0, abs=0.05)  # Haar: E tr² = 1
    small = se3.matrix_to_rotvec(_turns(1000, rng(), 0.1))
    assert np.linalg.norm(small, axis=1).max() <= 0.1 + 1e-9
