"""The virtual arms against numbers worked by hand, and against the package's chain."""

import numpy as np
import pytest
from checks import joint_wrenches
from generator import ARMS, VirtualArm, aria, katana, move, turn

from workbench import Motion, load_robot, tool_poses

BUILT_IN = {"aria": "aria", "aria-table3": "aria-table3", "aria-table4": "aria-table4", "katana": "katana450"}


def as_robot(arm, folder):
    path = folder / "arm.toml"
    path.write_text(arm.toml())
    return load_robot(path)


def test_aria_at_zero_by_hand():
    # up 0.205; out 0.41; joint 3 turns its x up: 0.03 up, 4.8 mm to the left; forearm 0.336 out;
    # wrist 49 mm to the left; tool 0.202 out
    expected = [0.41 + 0.336 + 0.202, 0.0048 + 0.049, 0.205 + 0.03]
    pose = aria().pose(np.zeros(6))[0]
    np.testing.assert_allclose(pose[:3, 3], expected, atol=1e-15)
    np.testing.assert_allclose(pose[:3, :3], [[0, 0, 1], [0, -1, 0], [1, 0, 0]], atol=1e-15)


def test_katana_at_zero_by_hand():
    # stretched along x: 0.19 + 0.139, then joint 5's axis points down from the wrist, 0.1473 along it
    pose = katana().pose(np.zeros(5))[0]
    np.testing.assert_allclose(pose[:3, 3] - [0.055, 0.055, 0.2015], [0.329, -0.2, 0.1473], atol=1e-15)


def test_moment_of_a_level_arm_by_hand():
    # one link of 2 kg, its centre 0.3 m out on a horizontal axis: 2 · 9.81 · 0.3 held upwards
    arm = VirtualArm(
        "hayati",
        np.array([[0, 0, 0, np.pi / 2, 0], [0, 0, 0.5, 0, 0]]),
        masses=np.array([1.0, 2.0]),
        coms=np.array([[0, 0, 0], [-0.2, 0, 0.0]]),
    )
    moments = arm.moments(np.zeros((1, 2)))
    # joint 2's axis, z of frame 1, points along −y of the base; a moment about −y lifts +x
    np.testing.assert_allclose(moments[0, 1], [0, 0, 2 * 9.81 * 0.3], atol=1e-12)
    np.testing.assert_allclose(moments[0, 0], [0, -2 * 9.81 * 0.3, 0], atol=1e-12)
    loaded = arm.moments(np.zeros((1, 2)), payload=3.0)
    np.testing.assert_allclose(loaded[0, 1, 2] - moments[0, 1, 2], 3 * 9.81 * 0.5, atol=1e-12)


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
    robot = as_robot(arm, tmp_path)
    q = arm.random(rng, 20)
    np.testing.assert_allclose(tool_poses(robot, Motion(q)), arm.pose(q), atol=2e-14)


@pytest.mark.parametrize("slides", [(True, False, False), (False, True, False), (False, False, True)])
@pytest.mark.parametrize("convention", ["hayati", "dh", "craig"])
def test_sliding_joints_equal_the_chain(convention, slides, tmp_path):
    rng = np.random.default_rng(5)
    table = rng.uniform(-1, 1, (3, 5))
    arm = VirtualArm(convention, table, slides=slides)
    q = rng.uniform(-1, 1, (10, 3))
    np.testing.assert_allclose(tool_poses(as_robot(arm, tmp_path), Motion(q)), arm.pose(q), atol=1e-14)


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
    wrenches = joint_wrenches(as_robot(arm, tmp_path), q, payload=np.full(20, payload))
    np.testing.assert_allclose(wrenches[:, :, 3:], arm.moments(q, payload), atol=1e-10)
