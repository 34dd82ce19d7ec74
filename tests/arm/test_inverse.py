"""Inverse kinematics: every branch, its name, the reason where there is none, following, and reach."""

import tomllib
from dataclasses import replace

import numpy as np
import pytest
from refusals import mentions
from slow import slow

from workbench import Motion, Robot, load_robot
from workbench.arm import chain as chains
from workbench.arm.inverse import solve as inverse
from workbench.arm.inverse.branch import roomy
from workbench.arm.inverse.reduced_arm import compile_arm
from workbench.arm.kinematics import forward
from workbench.arm.kinematics import reachable as reach
from workbench.arm.robot import JointKind
from workbench.arm.robot_toml import robot_from_rows
from workbench.arm.signs_and_offsets import with_couplings
from workbench.base import se3
from workbench.base.assets import assets
from workbench.base.errors import OptionError

UNLIMITED = np.tile([-np.inf, np.inf], (6, 1))


def perturbed(robot: Robot, seed: int, *, mm: float = 5.0, degrees: float = 5.0) -> Robot:
    """The arm with manufacturing errors of every constant, up to the given ones."""
    rng = np.random.default_rng(seed)
    sizes = {e.name: np.radians(degrees) if e.axis.turns else mm * 1e-3 for e in robot.elements}
    values = {e.name: e.value + rng.uniform(-1, 1) * sizes[e.name] for e in robot.elements}
    return robot.with_values(values)


def wrapped(gap: np.ndarray) -> np.ndarray:
    return np.abs((gap + np.pi) % (2 * np.pi) - np.pi)


def random_targets(robot: Robot, count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    q = np.random.default_rng(seed).uniform(-np.pi, np.pi, (count, robot.dof))
    return q, forward.tool_poses(robot, Motion(q))


def oracle(robot: Robot, target: np.ndarray, starts: int, rng: np.random.Generator) -> np.ndarray:
    """Distinct solutions by damped Newton on the chain from many starts; shares no code with ours."""
    axis_only = robot.dof == 5
    q = rng.uniform(-np.pi, np.pi, (starts, robot.dof))
    columns = robot.chain.driven

    def gaps(q):
        pose, jacobian = chains.twists(robot.chain, q, columns)
        if axis_only:
            z, want = pose[:, :3, 2], np.broadcast_to(target[:3, 2], (len(q), 3))
            cross = np.cross(z, want)
            sine = np.linalg.norm(cross, axis=1)
            angle = np.arctan2(sine, z @ target[:3, 2])
            turn = cross * (angle / np.maximum(sine, 1e-300))[:, None]
            across = np.eye(3) - z[:, :, None] * z[:, None, :]
            jacobian = np.concatenate([jacobian[:, :3], across @ jacobian[:, 3:]], 1)
            return np.concatenate([target[:3, 3] - pose[:, :3, 3], turn], 1), jacobian
        return se3.pose_error(np.broadcast_to(target, pose.shape), pose), jacobian

    damping = np.full(starts, 1e-2)
    error, jacobian = gaps(q)
    for _ in range(45):
        on = np.flatnonzero((np.linalg.norm(error, axis=1) > 1e-12) & (damping < 1e6))
        slope, was = jacobian[on], error[on]
        normal = np.swapaxes(slope, 1, 2) @ slope + damping[on, None, None] * np.eye(robot.dof)
        step = np.linalg.solve(normal, np.swapaxes(slope, 1, 2) @ was[:, :, None])[:, :, 0]
        step *= np.minimum(1.0, 0.7 / np.maximum(np.abs(step).max(1), 1e-12))[:, None]
        new_error, new_jacobian = gaps(q[on] + step)
        better = (new_error**2).sum(1) < (was**2).sum(1)
        q[on[better]] += step[better]
        error[on[better]], jacobian[on[better]] = new_error[better], new_jacobian[better]
        damping[on] = np.maximum(np.where(better, damping[on] * 0.1, damping[on] * 8), 1e-14)
    q = q[np.linalg.norm(error, axis=1) < 1e-10]
    kept = []
    while len(q):
        kept.append(q[0])
        q = q[wrapped(q - q[0]).max(1) > 1e-3]
    return np.array(kept).reshape(-1, robot.dof)


def table2() -> np.ndarray:
    plate = tomllib.loads((assets() / "plates" / "table2.toml").read_text())
    return np.array(
        [se3.pose(se3.rpy_to_matrix(np.array(t["rpy"])), np.array(t["xyz"])) for t in plate["target"]]
    )


def coupled(name: str, *, wrist: float = 0.0) -> Robot:
    """The arm with joint 3 counted from the horizontal, and a wrist whose drives turn together."""
    ratios = np.zeros((6, 6))
    ratios[2, 1], ratios[4, 5] = 1.0, wrist
    return with_couplings(load_robot(name), ratios)


@pytest.mark.parametrize("wrist", [0.0, -1.0, 0.5])
def test_coupled_joints_keep_their_own_limits(wrist):
    robot = coupled("ur5", wrist=wrist)
    low, high = np.tile([[-1.5], [2.0]], 6)
    robot = replace(robot, joints=tuple(replace(j, limits=(-1.5, 2.0)) for j in robot.joints))
    q = np.random.default_rng(2).uniform(low, high, (40, 6))
    targets = forward.tool_poses(robot, Motion(q))
    for own, target, result in zip(q, targets, inverse.solve_many(robot, targets), strict=True):
        inside = np.array([b.q for b in result.within_limits])
        assert ((low <= inside) & (inside <= high)).all()
        np.testing.assert_allclose(
            forward.tool_poses(robot, Motion(inside)), [target] * len(inside), atol=1e-9
        )
        assert wrist == 0.5 or np.abs(inside - own).max(1).min() < 1e-6
    found = inverse.follow_many(robot, targets, np.clip(q + 0.01, low, high))
    assert found.converged.mean() > 0.9
    np.testing.assert_allclose(found.q[found.converged], q[found.converged], atol=1e-6)
    mask, reached = reach.reachable(robot, targets)
    assert mask.all()
    np.testing.assert_allclose(forward.tool_poses(robot, Motion(reached)), targets, atol=1e-6)


def down(x: float, y: float, z: float) -> np.ndarray:
    return se3.pose(se3.rpy_to_matrix(np.array([np.pi, 0.0, 0.0])), np.array([x, y, z]))


@pytest.mark.parametrize(
    ("name", "seed"), [("aria", 1), ("ur5", None), ("katana450", 1), slow("aria", None), slow("ur5", 1)]
)
def test_all_branches_are_found(name, seed):
    robot = load_robot(name) if seed is None else perturbed(load_robot(name), seed)
    _, targets = random_targets(robot, 30, 11)
    limits = UNLIMITED[: robot.dof]
    results = inverse.solve_many(robot, targets, limits=limits)
    rng = np.random.default_rng(3)
    there = found = 0
    for target, result in zip(targets, results, strict=True):
        ours = np.array([b.q for b in result.branches])
        expected = oracle(robot, target, 150, rng)
        there += len(expected)
        found += sum(wrapped(ours - q).max(1).min() < 2e-3 for q in expected)
    assert there > 90
    assert found >= 0.999 * there, f"{found} of {there} branches"


@pytest.mark.parametrize("name", ["aria", "aria-table3", "aria-table4", "ur5", "ur10", "katana450"])
def test_branches_reach_the_target_and_contain_the_origin(name):
    robot = perturbed(load_robot(name), 4)
    q, targets = random_targets(robot, 30, 5)
    for own, target, result in zip(
        q, targets, inverse.solve_many(robot, targets, limits=UNLIMITED[: robot.dof]), strict=True
    ):
        ours = np.array([b.q for b in result.branches])
        poses = forward.tool_poses(robot, Motion(ours))
        assert np.abs(poses[:, :3, 3] - target[:3, 3]).max() < 1e-9
        part = slice(2, 3) if robot.dof == 5 else slice(0, 3)
        assert np.abs(poses[:, :3, part] - target[:3, part]).max() < 2e-9
        assert wrapped(ours - own).max(1).min() < 1e-5
        assert len(set(result.names)) == len(result.branches) <= 16
        assert result.reachable


def test_table_2_is_reached_within_limits_in_eight_ways(aria):
    for result in inverse.solve_many(aria, table2()):
        assert len(result.within_limits) == 8
        assert not any("(" in name for name in result.names)
        assert result.nearest.position_error < 1e-9
        q = np.array([branch.q for branch in result.within_limits])
        assert (np.clip(q, *aria.limits.T) == q).all()


def test_a_joint_that_moves_little_keeps_a_quarter_of_its_travel():
    """All branches of a SCARA need the same height: rounding must not choose between them."""
    arm = [{"d": 0.4, "a": 0.3}, {"a": 0.25, "alpha": np.pi}, {"type": "prismatic"}, {}]
    rows = [{"type": "revolute", "theta": 0.0, "d": 0.0, "a": 0.0, "alpha": 0.0} | row for row in arm]
    limits = np.array([[-2.5, 2.5], [-2.5, 2.5], [0.0, 0.2], [-3.0, 3.0]])
    robot = robot_from_rows(rows, "dh", limits=limits)
    for height, has_room in ((0.1, True), (0.06, True), (0.04, False)):
        q = np.array([[0.4, -1.2, height, 0.7]])
        branches = inverse.solve(robot, forward.tool_poses(robot, Motion(q))[0]).within_limits
        kept = roomy(branches)
        assert len(kept) > 0.5 * len(branches)
        assert {b.is_roomy for b in kept} == {has_room}


def test_a_redundant_arm_shows_postures_with_room():
    arm = load_robot("panda")
    pose = forward.tool_poses(arm, Motion(arm.limits.mean(1)[None]))[0]
    assert all(branch.is_roomy for branch in inverse.solve(arm, pose).branches)


def test_names_are_kept_from_pose_to_pose_and_from_nominal_to_calibrated():
    nominal = load_robot("aria")
    actual = perturbed(nominal, 2, mm=2.0, degrees=1.0)
    kept = total = 0
    for target in table2():
        near = target.copy()
        near[:3, 3] += [0.004, -0.003, 0.002]
        named = {b.name: b.q for b in inverse.solve(nominal, target).branches}
        for other in (inverse.solve(nominal, near), inverse.solve(actual, target)):
            for branch in other.branches:
                gaps = {name: np.linalg.norm(wrapped(q - branch.q)) for name, q in named.items()}
                closest = min(gaps, key=gaps.get)
                if gaps[closest] < 0.2:  # else a pair of solutions that the other pose does not have
                    total += 1
                    kept += closest == branch.name
    assert total >= 158
    assert kept == total


def test_choice_by_name_by_joints_and_automatic(aria):
    result = inverse.solve(aria, table2()[0])
    wanted = result.within_limits[5]
    assert inverse.choose(result, branch=wanted.name) is wanted
    assert inverse.choose(result, branch=wanted.q + 0.01).name == wanted.name
    near = wanted.q + np.array([2 * np.pi, 0, 0, 0, 0, 0]) * (1 if wanted.q[0] < 0 else -1)
    turned = inverse.choose(result, near=near)
    assert turned.name == wanted.name
    assert np.abs(turned.q - near).max() < 1e-9
    assert turned.margin <= wanted.margin + 1e-12
    assert inverse.choose(result).within_limits
    with pytest.raises(OptionError):
        inverse.choose(result, branch="elbow sideways")
    assert inverse.choose(inverse.solve(aria, down(2.0, 0.0, 0.3))) is None


def test_reasons(aria):
    far = inverse.solve(aria, down(2.0, 0.0, 0.205))
    assert not far.reachable
    assert mentions(far.reason, "mm")
    assert far.nearest.position_error > 0.9
    free = inverse.solve(aria, table2()[0])
    limits = aria.limits.copy()
    limits[1] = [2.5, 2.6]
    held = inverse.solve(aria, table2()[0], limits=limits)
    assert mentions(held.reason, "joint 2")
    assert len(held.branches) == len(free.branches)
    assert not held.within_limits
    assert 2.5 <= held.nearest.q[1] <= 2.6
    assert held.nearest.position_error > 1e-4


def test_a_prismatic_arm_is_searched():
    entries = load_robot("aria")
    drivers = {"joint3.d": 2, "joint3.theta": None}
    elements = [replace(e, joint=drivers.get(e.name, e.joint)) for e in entries.elements]
    joints = tuple(
        replace(j, kind=JointKind.PRISMATIC, limits=(-0.3, 0.3)) if i == 2 else j
        for i, j in enumerate(entries.joints)
    )
    robot = perturbed(replace(entries, elements=tuple(elements), joints=joints), 8)
    assert compile_arm(robot).slides.tolist() == [False, False, True, False, False, False]
    rng = np.random.default_rng(0)
    low, high = np.maximum(robot.limits, -3).T[0], np.minimum(robot.limits, 3).T[1]
    for q in rng.uniform(low, high, (10, 6)):
        target = forward.tool_poses(robot, Motion(q[None]))[0]
        result = inverse.solve(robot, target)
        assert min(wrapped(b.q - q).max() for b in result.branches) < 1e-6


def test_follow_keeps_the_branch_and_the_limits(aria):
    target = table2()[0].copy()
    start = inverse.choose(inverse.solve(aria, target))
    q = start.q
    for _ in range(50):
        target[0, 3] -= 2e-3
        step = inverse.follow(aria, target, q)
        assert step.converged
        assert np.abs(step.q - q).max() < 0.2
        q = step.q
    assert np.abs(forward.tool_poses(aria, Motion(q[None]))[0] - target).max() < 1e-9
    target[0, 3] = 2.0
    stuck = inverse.follow(aria, target, q)
    assert not stuck.converged
    assert stuck.position_error > 0.5
    assert ((stuck.q >= aria.limits[:, 0]) & (stuck.q <= aria.limits[:, 1])).all()


def test_reach_agrees_with_the_full_solution(aria):
    rng = np.random.default_rng(2)
    rotations = se3.rotvec_to_matrix(rng.normal(size=(120, 3)) * 1.5)
    poses = se3.pose(rotations, rng.uniform(-0.8, 0.8, (120, 3)))
    mask, q = reach.reachable(aria, poses)
    full = np.array([r.reachable for r in inverse.solve_many(aria, poses)])
    assert not (mask & ~full).any()
    assert mask.sum() >= full.sum() - 2
    assert 0.2 < mask.mean() < 0.8
    assert np.abs(forward.tool_poses(aria, Motion(q[mask])) - poses[mask]).max() < 1e-8
    assert np.isnan(q[~mask]).all()
    assert ((q[mask] >= aria.limits[:, 0] - 1e-9) & (q[mask] <= aria.limits[:, 1] + 1e-9)).all()


def test_a_singular_pose_is_reached_within_the_limits_where_its_family_has_a_member_there():
    """A straight wrist: only joint 4 + joint 6 matters, and both may turn by 17° alone."""
    robot, rng = load_robot("ur5e"), np.random.default_rng(0)
    limits = np.array(robot.search_limits, float)
    limits[[3, 5]] = [-0.3, 0.3]
    q = rng.uniform(*limits.T, (8, 6))
    q[:, 4] = 0.0
    for found in inverse.solve_many(robot, forward.tool_poses(robot, Motion(q)), limits=limits):
        assert found.reachable, found.reason
