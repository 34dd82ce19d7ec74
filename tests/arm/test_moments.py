"""Moments at the joints against pinocchio, in motion, under a wrench at the tool and on a deflected arm."""

import numpy as np
import pinocchio as pin
from rigid_body import rigid_body

from workbench import Motion
from workbench.arm.statics.moments import joint_moments

ROWS = 12


def swing(robot, rows=ROWS, seed=0):
    """Joint positions, velocities and accelerations at random."""
    rng = np.random.default_rng(seed)
    q, velocity, acceleration = (rng.uniform(-2.0, 2.0, (rows, robot.dof)) for _ in range(3))
    return Motion(q, velocity=velocity, acceleration=acceleration)


def expected(robot, motion):
    """By the library's recursion, in each joint's axes before its drive; all joints turn about z."""
    body = rigid_body(robot)
    return body.wrenches(motion.q, velocity=motion.velocity, acceleration=motion.acceleration)


def test_moments_in_motion_are_those_of_pinocchio(katana):
    motion = swing(katana)
    found, whole = joint_moments(katana, motion), expected(katana, motion)
    np.testing.assert_allclose(found.about, whole[:, :, 5], atol=1e-10)
    np.testing.assert_allclose(found.across, whole[:, :, 3:5], atol=1e-10)
    np.testing.assert_allclose(found.tipping, np.hypot(whole[:, :, 3], whole[:, :, 4]), atol=1e-10)
    still = joint_moments(katana, Motion(motion.q))
    assert np.abs(still.about - found.about).max() > 0.1


def test_a_wrench_at_the_tool_is_held_by_the_transposed_jacobian(katana):
    """pinocchio's Jacobian of the tool, in the measuring frame's axes; the Katana's base is not turned."""
    q, body = swing(katana).q, rigid_body(katana)
    wrench = np.random.default_rng(5).uniform(-20.0, 20.0, (ROWS, 6))
    data = body.model.createData()
    found = joint_moments(katana, Motion(q, wrench=wrench)).about - joint_moments(katana, Motion(q)).about
    for row in range(ROWS):
        jacobian = pin.computeFrameJacobian(
            body.model, data, q[row], body.tool, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        )
        np.testing.assert_allclose(found[row], -jacobian.T @ wrench[row], atol=1e-10)
