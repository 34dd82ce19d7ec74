"""Inverse kinematics of arms that bend, against forward evaluation."""

import generator
import numpy as np
import pytest
from checks import robot_of

from workbench import Motion, tool_poses
from workbench.arm.effects import EFFECTS
from workbench.arm.inverse import solve as inverse
from workbench.arm.inverse.damped_newton import Task

SOFT = (
    EFFECTS["joint-compliance"]((1, 2), (2e-4, 3e-4)),
    EFFECTS["joint-harmonic"]((0, 3), (1e-3, -5e-4, 7e-4, 2e-4), order=5),
    EFFECTS["encoder-scale"]((2,), (2e-3,)),
)


@pytest.fixture(scope="module")
def arms(tmp_path_factory):
    folder, rng = tmp_path_factory.mktemp("arms"), np.random.default_rng(1)
    made = {
        name: generator.ARMS[name]().perturbed(rng, length=2e-3, angle=0.01) for name in ("aria", "katana")
    }
    return {name: robot_of(arm, folder) for name, arm in made.items()}


def reached(robot, q, motion):
    return tool_poses(robot, motion.at(q[None]))[0]


@pytest.mark.parametrize("seed", range(5))
def test_every_branch_of_a_bent_arm_reaches_the_target(arms, seed):
    backlash = EFFECTS["backlash"]((3,), (1e-3,), by="motion")
    robot = arms["aria"].with_effects(*SOFT, backlash)
    rng = np.random.default_rng(seed)
    q = rng.uniform(0.6 * robot.limits[:, 0], 0.6 * robot.limits[:, 1])
    motion = Motion(q[None], payload=np.array([1.5]), direction=rng.choice([-1.0, 1.0], (1, 6)))
    target = tool_poses(robot, motion)[0]
    found = inverse.solve(robot, target, motion=motion)
    rigid = inverse.solve(robot.with_effects(), target)
    assert len(found.branches) == len(rigid.branches) >= 2
    for branch in found.branches:
        np.testing.assert_allclose(reached(robot, branch.q, motion), target, atol=1e-9)
        assert branch.within_limits == bool(
            ((branch.q >= robot.limits[:, 0]) & (branch.q <= robot.limits[:, 1])).all()
        )
    gap = min(np.abs(np.angle(np.exp(1j * (b.q - q)))).max() for b in found.branches)
    assert gap < 2e-3 * 2 * np.pi  # the scale tells turns apart
    followed = inverse.follow(robot, target, q + 0.01, motion=motion)
    assert followed.converged
    np.testing.assert_allclose(followed.q, q, atol=1e-8)


def test_five_joints_meet_position_and_axis(arms):
    robot = arms["katana"].with_effects(EFFECTS["joint-compliance"]((1, 2, 3), (1e-3, 1e-3, 1e-3)))
    q = np.array([0.3, 1.0, -1.2, 0.8, 0.5])
    motion = Motion(q[None])
    target = tool_poses(robot, Motion(q[None]))[0]
    found = inverse.solve(robot, target)
    assert found.task is Task.POSITION_AXIS
    assert found.branches
    for branch in found.branches:
        np.testing.assert_allclose(reached(robot, branch.q, motion)[:3, 2:], target[:3, 2:], atol=1e-9)


def test_a_load_that_turns_within_the_play(arms):
    """At the pose where joint 2 is balanced, either flank throws the tool to the other side of the target."""
    play = EFFECTS["backlash"]((1,), (1e-3,))
    robot = arms["aria"].with_effects(play)
    balanced = _balanced(robot)
    target = tool_poses(robot.with_effects(), Motion(balanced[None]))[0]
    found = inverse.solve(robot, target)
    chosen = inverse.choose(found, near=balanced)
    error = np.linalg.norm(reached(robot, chosen.q, Motion(balanced[None]))[:3, 3] - target[:3, 3])
    assert 1e-5 < error < 2e-3 * robot.reach
    followed = inverse.follow(robot, target, balanced)
    assert not followed.converged
    assert followed.position_error < 2e-3 * robot.reach


def _balanced(robot):
    """Joint positions where the links behind joint 2 stand upright over it."""
    from checks import holding, joint_wrenches
    from scipy.optimize import brentq

    q = np.array([0.2, 0.0, 0.4, 0.3, -0.6, 0.1])

    def moment(value):
        q[1] = value
        return float(holding(joint_wrenches(robot, q[None]), robot)[0, 1])

    grid = np.linspace(*robot.limits[1], 40)
    values = [moment(v) for v in grid]
    at = next(i for i in range(39) if values[i] * values[i + 1] < 0)
    q[1] = brentq(moment, grid[at], grid[at + 1], xtol=1e-14)
    return q
