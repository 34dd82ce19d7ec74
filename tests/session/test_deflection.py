"""The arm drawn as its loads bend it, the plate of an arm with five joints, and influences to first order."""

import numpy as np
import pytest

from workbench import Motion, link_frames, load_robot, tool_poses
from workbench.arm.effects import EFFECTS
from workbench.arm.kinematics.skeleton import height_above_floor
from workbench.base import se3
from workbench.session.commands.arm import ChooseRobot
from workbench.session.commands.data import MeasureVirtualArm
from workbench.session.commands.identify import Identify
from workbench.session.deflection import MAX_DRAWN, bend, drawable_bending
from workbench.views.appearance.bodies import body_frames

Q = np.array([0.4, 0.7, -0.9, -0.6, 0.8])


def test_joints_turn_and_tilt_as_table_4_3_and_4_4_say():
    robot = load_robot("katana450-tilting")
    deflected = bend(robot, Q)
    clearance, backlash, compliance = (np.array(effect.coefficients) for effect in robot.effects)
    assert np.rad2deg(clearance) == pytest.approx([0.022, 0.024, 0.017, 0.015, 0.018], rel=1e-5)
    assert np.rad2deg(backlash) == pytest.approx([0.063, 0.061, 0.057, 0.046, 0.051], rel=1e-5)
    assert 1.0 / np.rad2deg(compliance) / 9.80665 == pytest.approx([122, 90, 75, 78, 80], rel=1e-5)
    assert deflected.across == pytest.approx(clearance, rel=1e-12)
    held = deflected.moment[1:, 0]
    assert deflected.about[1:] == pytest.approx(
        -backlash[1:] * np.sign(held) - compliance[1:] * held, rel=1e-9
    )
    assert abs(held[0]) > 1.0  # the shoulder carries the arm


def test_the_last_body_of_the_bent_arm_is_where_its_tool_says():
    robot = load_robot("katana450-tilting")
    frames = body_frames(robot, Q, shift=bend(robot, Q).shift)
    to_tool = se3.inverse(link_frames(robot, Motion(Q[None]))[0, -1]) @ tool_poses(robot, Motion(Q[None]))[0]
    straight = robot.with_effects()
    from_body = se3.inverse(body_frames(straight, Q)[-1]) @ (
        se3.inverse(straight.base.pose) @ link_frames(straight, Motion(Q[None]))[0, -1]
    )
    tool = robot.base.pose @ frames[-1] @ from_body @ to_tool
    assert np.allclose(tool, tool_poses(robot, Motion(Q[None]))[0], atol=1e-9)
    assert np.linalg.norm(tool[:3, 3] - tool_poses(straight, Motion(Q[None]))[0, :3, 3]) > 3e-4


@pytest.mark.parametrize(("times", "compliance"), [(1.0, 1e-4), (50.0, 1e-3), (500.0, 5e-3), (5000.0, 1e-2)])
def test_a_bent_arm_is_drawn_as_far_off_as_a_tenth_of_its_reach_at_most(times, compliance):
    robot = load_robot("katana450")
    robot = robot.with_effects(EFFECTS["joint-compliance"]((1,), (compliance,)))
    drawn = drawable_bending(robot, Q, times)
    straight, deflected = body_frames(robot, Q), body_frames(robot, Q, shift=drawn * bend(robot, Q).shift)
    off = np.linalg.norm((deflected - straight)[:, :3, 3], axis=1).max()
    assert 0.0 < off <= MAX_DRAWN * robot.reach
    assert drawn == times if times == 1.0 else off > 0.5 * MAX_DRAWN * robot.reach


def test_katana_stands_on_its_table_and_is_measured_and_identified(do):
    session = do(ChooseRobot("katana450"))
    assert session.score.measurable == 10
    assert all(not state.hit for state in session.states)
    assert height_above_floor(session.robot) == 0.2015
    assert session.plate.xyz[2] > -0.2015
    session = do(MeasureVirtualArm(3, more=30), Identify(("opt2",)))
    assert session.results.identification.runs["opt2"].held_out.position_mm.mean < 0.5
    assert session.results.identification.nominal.held_out.position_mm.mean > 5.0
