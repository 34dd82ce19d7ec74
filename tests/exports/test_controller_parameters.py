from dataclasses import replace

import numpy as np
import pytest
from checks import with_errors

from workbench import Motion, load_robot, tool_poses
from workbench.arm.calibration_record import Calibration, Expected, Observed
from workbench.arm.frame import FRAME_PARTS, Frame
from workbench.arm.usable_arm import sampled
from workbench.base import se3
from workbench.exports.controller_parameters import controller_numbers

OFFSETS = np.array([0.01, -0.02, 0.005, 0.03, -0.004, 0.002])


@pytest.fixture(scope="module")
def nominal():
    turns = se3.rotvec_to_matrix(np.array([[0.1, 0.2, 0.9], [0.3, 0.0, 0.4]]))
    base, tool = map(Frame.from_pose, se3.pose(turns, np.array([[1.0, 0.5, 0.2], [0.02, 0.01, 0.1]])))
    return load_robot("aria").with_frames(base=base, tool=tool)


@pytest.mark.parametrize("parts", [("offsets",), ("offsets", "tool"), ("offsets", "tool", "base")])
def test_pure_offsets_are_recovered_exactly(nominal, parts):
    found = controller_numbers(with_errors(nominal, OFFSETS, nominal.joint_offsets), nominal, parts=parts)
    assert found.offsets == pytest.approx(OFFSETS, abs=1e-9)
    assert found.after.position_max < 1e-9
    assert found.after.rotation_max < 1e-9
    assert found.before.position_mean > 1e-3
    assert found.robot.tool.pose == pytest.approx(nominal.tool.pose, abs=1e-9)
    assert found.robot.base.pose == pytest.approx(nominal.base.pose, abs=1e-9)


def test_numbers_that_repeat_others_are_held_and_named(nominal):
    plain = nominal.with_frames(base=Frame(), tool=Frame())
    found = controller_numbers(with_errors(plain, OFFSETS, plain.joint_offsets), plain)
    assert set(found.held) == {"tool.yaw", "base.yaw"}  # joints 6 and 1 turn about the same axes


def test_frames_are_taken_from_the_calibrated_arm_and_corrected(nominal):
    rng = np.random.default_rng(3)
    shifts = {f"{f}.{p}": 1e-3 * rng.normal() for f in ("base", "tool") for p in FRAME_PARTS[3:]}
    calibrated = with_errors(nominal.with_values(shifts), OFFSETS, nominal.joint_offsets)
    found = controller_numbers(calibrated, nominal)
    q = rng.uniform(-1.0, 1.0, (20, 6))
    assert tool_poses(found.robot, Motion(q)) == pytest.approx(tool_poses(calibrated, Motion(q)), abs=1e-8)
    framed = nominal.with_frames(base=found.robot.base, tool=found.robot.tool)
    by_hand = tool_poses(framed, Motion(q + found.offsets))
    assert tool_poses(found.robot, Motion(q)) == pytest.approx(by_hand, abs=1e-12)


def test_the_answer_is_a_minimum(nominal):
    rng = np.random.default_rng(5)
    calibrated = with_errors(nominal, rng.normal(0, 3e-3, len(nominal.default_free)))
    q, found = sampled(calibrated), controller_numbers(calibrated, nominal)
    wanted = tool_poses(calibrated, Motion(q))

    def cost(robot):
        error = se3.pose_error(wanted, tool_poses(robot, Motion(q))) * ([1.0] * 3 + [0.3] * 3)
        return (error**2).sum()

    best = cost(found.robot)
    moved = [f"joint{k + 1}.theta" for k in range(6)] + ["tool.x", "tool.z", "base.y", "base.roll"]
    for name in moved:
        value = found.robot.values((name,))[0]
        assert all(cost(found.robot.with_values({name: value + step})) > best for step in (-1e-5, 1e-5))


def test_numbers_that_help_at_the_measured_poses_alone_are_not_advised(nominal):
    rng = np.random.default_rng(6)
    q = np.array([0.3, -0.8, 1.0, 0.4, 0.6, 0.2]) + rng.uniform(-0.1, 0.1, (60, 6))
    seen = Observed(position=3, rotation=3, tool=Expected(1e-5, 1e-5), flange=Expected(1e-5, 1e-5), q=q)
    lengths = {f"joint{k}.a": float(nominal.values((f"joint{k}.a",))[0]) + 0.02 for k in (2, 3)}
    calibrated = replace(
        nominal.with_values(lengths),
        calibration=Calibration(source="", poses=np.zeros(0, np.uint32), observed=seen),
    )
    found = controller_numbers(calibrated, nominal, parts=("offsets",))
    assert found.after.position_mean < 0.5 * found.before.position_mean
    assert any("limits" in loss for loss in found.losses)
    assert not found.is_better
    assert not any("limits" in loss for loss in controller_numbers(nominal, nominal).losses)
