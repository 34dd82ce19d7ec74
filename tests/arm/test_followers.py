"""Mimic joints of a URDF: poses, derivatives, loads, files and fits against plain matrices."""

import numpy as np
import pytest
from checks import check_jacobian, pose_change, with_numbers
from generator import move, turn

from workbench import Motion, Robot, identification_jacobian, read_urdf, tool_poses, write_toml, write_urdf
from workbench.arm.effects.joint_compliance import JointCompliance
from workbench.arm.inverse.damped_newton import Task
from workbench.arm.inverse.solve import solve_many
from workbench.arm.kinematics.forward import geometric_jacobian
from workbench.arm.robot_toml import read_toml
from workbench.arm.statics.wrenches import motion_wrenches, own_axis

LINK = '<link name="{}"><inertial><origin xyz="0.1 0.02 0.03"/><mass value="{}"/></inertial></link>'
JOINT = (
    '<joint name="{}" type="revolute"><parent link="{}"/><child link="{}"/><origin xyz="{}"/>'
    '<axis xyz="{}"/><limit lower="-2" upper="2" effort="9" velocity="1"/>{}</joint>'
)
RATIO, OFFSET = -0.7, 0.2
MIMIC = f'<mimic joint="lower" multiplier="{RATIO}" offset="{OFFSET}"/>'
TEXT = f"""<robot name="linkage"><link name="root"/>
{LINK.format("a", 4)}{LINK.format("b", 3)}{LINK.format("c", 2)}{LINK.format("d", 1)}
{JOINT.format("turn", "root", "a", "0 0 0.3", "0 0 1", "")}
{JOINT.format("lower", "a", "b", "0.1 0 0.2", "0 1 0", "")}
{JOINT.format("parallel", "b", "c", "0.4 0 0", "0 1 0", MIMIC)}
{JOINT.format("upper", "c", "d", "0.05 0 0.1", "0 1 0", "")}
<link name="tool"/><joint name="t" type="fixed"><parent link="d"/><child link="tool"/>
<origin xyz="0.3 0.02 0"/></joint></robot>"""
Q = np.random.default_rng(3).uniform(-1.5, 1.5, (40, 3))


@pytest.fixture
def robot(tmp_path):
    path = tmp_path / "linkage.urdf"
    path.write_text(TEXT, encoding="utf-8")
    return read_urdf(path)


def frames(q):
    """Frames of the links a, b, c, d and the tool, by matrices of their own."""
    lower = q[1]
    steps = [
        move("z", 0.3) @ turn("z", q[0]),
        move("x", 0.1) @ move("z", 0.2) @ turn("y", lower),
        move("x", 0.4) @ turn("y", RATIO * lower + OFFSET),
        move("x", 0.05) @ move("z", 0.1) @ turn("y", q[2]),
        move("x", 0.3) @ move("y", 0.02),
    ]
    out = [steps[0]]
    for step in steps[1:]:
        out.append(out[-1] @ step)
    return out


def test_a_follower_moves_with_its_joint(robot):
    assert robot.dof == 3
    np.testing.assert_allclose(tool_poses(robot, Motion(Q)), [frames(q)[-1] for q in Q], atol=1e-14)
    assert any("follows 'lower'" in note for note in robot.notes)
    slopes = geometric_jacobian(robot, Q[:1])[0]
    check_jacobian(lambda x: tool_poses(robot, x), slopes, Q[0], difference=pose_change)


def test_holding_moments_carry_the_bodies_behind_a_follower(robot):
    """Moments about the joints' axes against sums over point masses."""
    found = np.take_along_axis(
        motion_wrenches(robot, Motion(Q)), np.tile(own_axis(robot)[None, :, None], (len(Q), 1, 1)), axis=2
    )[..., 0]
    for q, moments in zip(Q, found, strict=True):
        at = frames(q)
        centres = [f[:3] @ [0.1, 0.02, 0.03, 1.0] for f in at[:4]]
        for joint, (frame, axis) in enumerate(((0, 2), (1, 1), (3, 1))):
            total = sum(
                np.cross(c - at[frame][:3, 3], [0, 0, 9.81 * m])
                for c, m in list(zip(centres, (4, 3, 2, 1), strict=True))[frame:]
            )
            assert moments[joint] == pytest.approx(total @ at[frame][:3, axis], abs=1e-11)


def test_deflections_of_such_an_arm_have_the_right_derivative(robot):
    soft = robot.with_effects(JointCompliance((1, 2), (2e-4, 5e-4)))
    names = (*robot.default_free, *soft.coefficients)
    start = np.array([*np.zeros(len(robot.default_free)), *soft.coefficients.values()])
    check_jacobian(
        lambda x: tool_poses(with_numbers(soft, names, x), Q[:3]),
        identification_jacobian(soft, Motion(Q[:3]), names)[1],
        start,
        difference=pose_change,
        tolerance=1e-6,
    )


@pytest.mark.parametrize("ending", ["toml", "urdf"])
def test_files_keep_the_follower(robot, ending, tmp_path):
    moved = robot.with_values({"fixed1.pitch": 0.01, "joint2.x": 0.002})
    path = tmp_path / f"copy.{ending}"
    (write_toml if ending == "toml" else write_urdf)(moved, path)
    back = (read_toml if ending == "toml" else read_urdf)(path)
    np.testing.assert_allclose(tool_poses(back, Motion(Q)), tool_poses(moved, Motion(Q)), atol=1e-12)
    np.testing.assert_allclose(motion_wrenches(back, Motion(Q)), motion_wrenches(moved, Motion(Q)), atol=1e-9)
    if ending == "toml":
        write_urdf(back, tmp_path / "frames.urdf")
        plain = read_urdf(tmp_path / "frames.urdf")
        np.testing.assert_allclose(tool_poses(plain, Motion(Q)), tool_poses(moved, Motion(Q)), atol=1e-12)


def test_a_passive_joint_of_a_table_moves_with_others(tmp_path):
    rows = [{"d": 0.3, "alpha": -1.5}, {"a": 0.8}, {"a": 0.9}, {"a": 0.2, "alpha": 1.5}]
    whole = Robot.from_dh(rows)
    rows[3] |= {"type": "fixed", "follows": [2, 3], "ratio": [-1.0, -0.5]}
    arm = read_toml(write_toml(Robot.from_dh(rows), tmp_path / "arm.toml"))
    every = np.column_stack([Q, -Q[:, 1] - 0.5 * Q[:, 2]])
    np.testing.assert_allclose(tool_poses(arm, Motion(Q)), tool_poses(whole, Motion(every)), atol=1e-14)
    assert {e.name for e in arm.elements if e.free} == {
        e.name.replace("joint4", "fixed1") for e in whole.elements if e.free
    }


def test_a_passive_joint_is_solved_for_by_the_joints_that_it_follows():
    level = {"a": 0.2, "alpha": 1.5, "type": "fixed", "follows": [2, 3], "ratio": [-1.0, -1.0]}
    arm = Robot.from_dh([{"d": 0.3, "alpha": -1.5}, {"a": 0.8}, {"a": 0.9}, level, {"d": 0.1, "alpha": 0.3}])
    wanted = tool_poses(arm, Motion(0.5 * np.column_stack([Q, Q[:, 0]])))
    for pose, found in zip(wanted, solve_many(arm, wanted, task=Task.POSITION), strict=True):
        assert found.branches
        reached = tool_poses(arm, Motion(np.array([branch.q for branch in found.branches])))
        np.testing.assert_allclose(reached[:, :3, 3] - pose[:3, 3], 0.0, atol=1e-7)
