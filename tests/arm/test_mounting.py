"""How an arm is mounted, for good and session by session."""

from dataclasses import replace

import numpy as np
import pytest
from generator import move, turn

from workbench import Frame, Mounting, load_robot, tool_poses
from workbench.arm.effects.joint_compliance import JointCompliance
from workbench.base.types import Freedom

BASE, TOOL = move("x", 0.4) @ turn("y", 0.1), move("z", 0.2) @ turn("x", 0.3)
Q = np.array([0.3, 1.1, -0.8, 0.4, 0.9, 0.2])


@pytest.fixture
def robot():
    robot = load_robot("aria").with_frames(
        base=Frame.from_pose(BASE, Freedom.FREE), tool=Frame.from_pose(TOOL)
    )
    front = robot.mounting.at(turn("z", 1.0) @ BASE, TOOL)
    return replace(robot, sessions={"front": front, "rear": robot.mounting})


def test_the_bare_arm_lies_between_base_and_tool(robot):
    bare = robot.with_effects(JointCompliance((1,), (1e-4,))).bare
    np.testing.assert_allclose(BASE @ tool_poses(bare, Q) @ TOOL, tool_poses(robot, Q), atol=1e-12)
    assert not bare.effects
    assert not bare.sessions


def test_an_arm_in_a_session_is_mounted_so_and_has_no_others(robot):
    turned = turn("z", 1.0) @ tool_poses(robot, Q)
    for front in (robot.in_session("front"), robot.in_first_session):
        np.testing.assert_allclose(tool_poses(front, Q), turned, atol=1e-12)
        assert front.base.free is Freedom.FREE
        assert not front.sessions
    assert robot.in_session("elsewhere").mounting is robot.mounting


def test_a_session_without_a_gravity_has_that_of_the_arm(robot):
    wall = replace(robot.under(np.array([9.81, 0.0, 0.0])), sessions={"front": Mounting(base=robot.base)})
    assert wall.in_session("front").gravity is wall.gravity
    assert wall.under(np.array([0.0, 9.81, 0.0])).in_session("front").gravity.tolist() == [0.0, 9.81, 0.0]
