"""The virtual arms against numbers worked by hand, and against the package's chain."""

import numpy as np
import pytest
from checks import joint_wrenches, robot_of
from generator import ARMS, VirtualArm, move, turn

from workbench import Motion, load_robot, tool_poses

BUILT_IN = {"aria": "aria", "aria-table3": "aria-table3", "aria-table4": "aria-table4", "katana": "katana450"}


@pytest.mark.parametrize("name", ARMS)
def test_poses_equal_the_chain(name, tmp_path):
    rng = np.random.default_rng(4)
    arm = ARMS[name]().perturbed(rng)
    arm = VirtualArm(
        arm.convention,
        arm.table,
        move("x", 0.3) @ turn("z", 1.0) @ turn("x", 0.4),
        turn("y", 0.7) @ move("z", 0.1),
        arm.limits,
        masses=arm.masses,
        coms=arm.coms,
    )
    robot = robot_of(arm, tmp_path)
    q = arm.random(rng, 20)
    np.testing.assert_allclose(tool_poses(robot, Motion(q)), arm.pose(q), atol=2e-14)


@pytest.mark.parametrize("slides", [(True, False, False), (False, True, False), (False, False, True)])
@pytest.mark.parametrize("convention", ["hayati", "dh", "craig"])
def test_sliding_joints_equal_the_chain(convention, slides, tmp_path):
    rng = np.random.default_rng(5)
    table = rng.uniform(-1, 1, (3, 5))
    arm = VirtualArm(convention, table, slides=slides)
    q = rng.uniform(-1, 1, (10, 3))
    np.testing.assert_allclose(tool_poses(robot_of(arm, tmp_path), Motion(q)), arm.pose(q), atol=1e-14)


@pytest.mark.parametrize(("name", "built_in"), BUILT_IN.items())
def test_built_in_arms_are_the_papers(name, built_in):
    arm = ARMS[name]()
    q = arm.random(np.random.default_rng(6), 20)
    robot = load_robot(built_in)
    np.testing.assert_allclose(tool_poses(robot, Motion(q)), arm.pose(q), atol=1e-14)
    np.testing.assert_allclose(robot.limits, arm.limits)


@pytest.mark.parametrize("name", ARMS)
def test_moments_equal_the_package(name, tmp_path):
    rng = np.random.default_rng(7)
    arm = ARMS[name]().perturbed(rng)
    q = arm.random(rng, 20)
    payload = 1.3
    wrenches = joint_wrenches(robot_of(arm, tmp_path), q, payload=np.full(20, payload))
    np.testing.assert_allclose(wrenches[:, :, 3:], arm.moments(q, payload), atol=1e-10)
