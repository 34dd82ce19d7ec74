"""Poses against pinocchio, and every column of every identification Jacobian against central differences."""

import numpy as np
import pytest
from checks import any_joints, check_forward, check_jacobian, pose_change, with_numbers

from tests.arm.test_statics import MIXED
from workbench import Frame, Motion, identification_jacobian, load_robot, tool_poses
from workbench.arm.chain import Axis
from workbench.arm.kinematics.forward import geometric_jacobian
from workbench.base import se3
from workbench.base.assets import built_in_robots
from workbench.base.types import frozen


@pytest.fixture(params=[*built_in_robots(), "mixed"])
def robot(request, tmp_path):
    path = tmp_path / "mixed.toml"
    path.write_text(MIXED)
    return load_robot(path if request.param == "mixed" else request.param).with_effects()


def framed(robot, rng):
    """The robot on a base and with a tool in general position."""

    def frame():
        return Frame(frozen(rng.normal(size=3)), frozen(se3.rotvec_to_matrix(rng.normal(size=3))))

    return robot.with_frames(base=frame(), tool=frame())


def test_every_column_of_the_full_chain(robot):
    robot = framed(robot, np.random.default_rng(1))
    q, names = (
        any_joints(robot, 3),
        tuple(e.name for e in robot.chain.elements if e.axis is not Axis.CONSTANT),
    )
    poses, twists = identification_jacobian(robot, Motion(q), names)
    np.testing.assert_allclose(poses, tool_poses(robot, Motion(q)), atol=1e-13)
    moved = lambda x: tool_poses(with_numbers(robot, names, x), q)  # noqa: E731
    assert check_jacobian(moved, twists, robot.values(names), difference=pose_change) < 1e-7


def test_poses_agree_with_pinocchio(robot):
    assert check_forward(robot, any_joints(robot, 50)) < 1e-12
    assert check_forward(framed(robot, np.random.default_rng(2)), any_joints(robot, 50)) < 1e-12


def test_joint_columns_are_the_derivative_by_the_joints(robot):
    robot = framed(robot, np.random.default_rng(3))
    (q,) = any_joints(robot, 1)
    found = geometric_jacobian(robot, q[None])[0]
    check_jacobian(lambda x: tool_poses(robot, x), found, q, difference=pose_change)
    assert [robot.chain.elements[k].joint for k in robot.chain.driven] == list(range(robot.dof))
