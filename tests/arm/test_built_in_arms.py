"""The built-in arms against sources other than their files: descriptions of others, documented poses."""

import numpy as np
import pytest
from generator import ARMS, turn
from round_trip import placed

from workbench import Motion, load_robot, tool_poses
from workbench.arm.joint_frames import joint_frames

QUARTER = 0.5 * np.pi


def check(name: str, origins) -> None:
    """Joints turn about their own z axes, each at its origin in the link before."""
    robot = load_robot(name)
    q, expected = np.random.default_rng(0).uniform(*robot.search_limits.T, (20, robot.dof)), np.eye(4)
    for frame, angle in zip(origins, q.T, strict=True):
        expected = expected @ placed(frame[:3], frame[3:]) @ turn("z", angle)
    np.testing.assert_allclose(tool_poses(robot, Motion(q)), expected, atol=1e-8)


@pytest.mark.parametrize(("name", "lengths"), [
    ("ur3e", (0.15185, -0.24355, -0.2132, 0.13105, 0.08535, 0.0921)),
    ("ur5e", (0.1625, -0.425, -0.3922, 0.1333, 0.0997, 0.0996)),
    ("ur10e", (0.1807, -0.6127, -0.57155, 0.17415, 0.11985, 0.11655)),
])  # fmt: skip
def test_ur_arms_are_those_of_ur_description(name, lengths):
    """Frames of ur_description (default_kinematics.yaml)."""
    d1, a2, a3, d4, d5, d6 = lengths
    frames = [
        (0, 0, d1, 0, 0, 0), (0, 0, 0, QUARTER, 0, 0), (a2, 0, 0, 0, 0, 0),
        (a3, 0, d4, 0, 0, 0), (0, -d5, 0, QUARTER, 0, 0), (0, d6, 0, QUARTER, np.pi, np.pi),
    ]  # fmt: skip
    check(name, frames)
    assert load_robot(name).has_masses


def test_xarm6_is_that_of_xarm_description():
    """Joint origins of its URDF, which has angles of 1.5708."""
    frames = [
        (0, 0, 0.267, 0, 0, 0), (0, 0, 0, -QUARTER, 0, 0), (0.0535, -0.2845, 0, 0, 0, 0),
        (0.0775, 0.3425, 0, -QUARTER, 0, 0), (0, 0, 0, QUARTER, 0, 0), (0.076, 0.097, 0, -QUARTER, 0, 0),
    ]  # fmt: skip
    check("xarm6", frames)


def test_iiwa7_has_the_documented_axes_and_height():
    """Axes at zero: z, y, z, −y, z, y, z at 340, 740 and 1140 mm; the flange 1266 mm up."""
    robot = load_robot("iiwa7")
    *frames, flange = joint_frames(robot).at_zero
    axes = [[0, 0, 1], [0, 1, 0], [0, 0, 1], [0, -1, 0], [0, 0, 1], [0, 1, 0], [0, 0, 1]]
    for frame, axis in zip(frames, axes, strict=True):
        np.testing.assert_allclose(frame[:3, 2], axis, atol=1e-8)
    np.testing.assert_allclose([frames[k][2, 3] for k in (1, 3, 5)], [0.34, 0.74, 1.14], atol=1e-8)
    np.testing.assert_allclose(flange[:3, 3], [0, 0, 1.266], atol=1e-8)


KATANAS = [(f"katana450{form}", "katana") for form in ("", "-three-rotation")]


@pytest.mark.parametrize(("name", "own"), [*KATANAS, *((n, n) for n in ARMS if "aria" in n)])
def test_the_arms_of_both_works_are_those_of_their_tables(name, own):
    robot, arm = load_robot(name), ARMS[own]()
    q = arm.random(np.random.default_rng(6), 20)
    np.testing.assert_allclose(tool_poses(robot, Motion(q)), arm.pose(q), atol=1e-14)
    np.testing.assert_allclose(robot.limits, arm.limits)
